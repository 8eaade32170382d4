#include "surfel/point_tree.hpp"

#include <algorithm>
#include <nanoflann.hpp>

namespace tribin::surfel_detail {
namespace {

struct PointSource {
  std::span<const Vec3f> points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][static_cast<Eigen::Index>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointSource>, PointSource, 3,
                                                  std::uint32_t>;

}  // namespace

struct PointTree::Tree {
  PointSource source;
  Index index;
  explicit Tree(std::span<const Vec3f> points) : source{points}, index(3, source, {16}) {}
};

PointTree::PointTree(std::span<const Vec3f> points) : tree_(std::make_unique<Tree>(points)) {}
PointTree::~PointTree() = default;

void PointTree::nearest(const Vec3f& at, std::size_t k, std::vector<std::uint32_t>& out) const {
  thread_local std::vector<std::pair<float, std::uint32_t>> sorted;
  thread_local std::vector<float> distances;
  out.resize(k);
  distances.resize(k);
  const std::size_t count = tree_->index.knnSearch(at.data(), k, out.data(), distances.data());
  sorted.clear();
  for (std::size_t i = 0; i < count; ++i) sorted.emplace_back(distances[i], out[i]);
  std::sort(sorted.begin(), sorted.end());
  out.resize(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = sorted[i].second;
}

}  // namespace tribin::surfel_detail
