#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace tribin {

/// Boxes in boxes around things that have a middle: halves of equally many, cut across the longest way of the middles.
/// \tparam Vec  Vec3 or Vec3f
template <typename Vec>
struct BoxTree {
  struct Node {
    Vec low, high;
    std::uint32_t begin = 0, end = 0;  ///< range in `order` of what it holds
    std::uint32_t right = 0;           ///< the second child; the first follows its parent; 0 = leaf
  };
  std::vector<std::uint32_t> order;
  std::vector<Node> nodes;  ///< the root first; empty where there is nothing
};

/// The same input gives the same tree.
/// \param middles  of the things.
/// \param grow     grow(thing, low, high) lets a box hold a thing.
/// \param leaf     so many things are not halved any more; >= 1.
template <typename Vec, typename Grow>
BoxTree<Vec> make_box_tree(const std::vector<Vec>& middles, const Grow& grow, std::uint32_t leaf) {
  BoxTree<Vec> tree;
  tree.order.resize(middles.size());
  std::iota(tree.order.begin(), tree.order.end(), 0u);
  const auto build = [&](const auto& self, std::uint32_t begin, std::uint32_t end) -> std::uint32_t {
    using Scalar = typename Vec::Scalar;
    const auto index = static_cast<std::uint32_t>(tree.nodes.size());
    Vec low = Vec::Constant(std::numeric_limits<Scalar>::infinity()), high = -low, first = low, last = high;
    for (std::uint32_t i = begin; i < end; ++i) {
      grow(tree.order[i], low, high);
      first = first.cwiseMin(middles[tree.order[i]]);
      last = last.cwiseMax(middles[tree.order[i]]);
    }
    tree.nodes.push_back({low, high, begin, end, 0});
    if (end - begin <= leaf) return index;
    int axis = 0;
    (last - first).maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(tree.order.begin() + begin, tree.order.begin() + middle, tree.order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return middles[a][axis] != middles[b][axis] ? middles[a][axis] < middles[b][axis] : a < b;
                     });
    self(self, begin, middle);
    const std::uint32_t right = self(self, middle, end);
    tree.nodes[index].right = right;
    return index;
  };
  if (!middles.empty()) build(build, 0, static_cast<std::uint32_t>(middles.size()));
  return tree;
}

/// Looks at what lies in boxes worth it, the first half of each before the second.
/// \param enters  enters(node): may it hold something of interest? Asked when its turn comes, so that what was found
///                before may close it.
/// \param look    look(thing), in the order of the tree.
template <typename Vec, typename Enters, typename Look>
void visit(const BoxTree<Vec>& tree, const Enters& enters, const Look& look) {
  if (tree.nodes.empty()) return;
  std::array<std::uint32_t, 64> stack{};  // one a level, of halves: enough for any mesh
  std::size_t depth = 1;
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    const typename BoxTree<Vec>::Node& node = tree.nodes[index];
    if (!enters(node)) continue;
    if (node.right != 0) {
      stack[depth++] = node.right;
      stack[depth++] = index + 1;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) look(tree.order[i]);
  }
}

}  // namespace tribin
