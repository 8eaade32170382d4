#pragma once

#include <cstdint>
#include <vector>

namespace tribin::segmentation_detail {

/// The cheapest way to part the nodes of a graph into two sides, each node paying for its side and each edge for being
/// cut. \source Dinic, 1970: shortest augmenting paths by levels.
class MinCut {
 public:
  explicit MinCut(std::size_t nodes);

  /// What node i pays for the first and for the second side; either sign.
  void add_node(std::uint32_t i, double first, double second);
  /// Paid where a is on the first side and b on the second. \param cost  >= 0; may be infinite.
  void add_edge(std::uint32_t a, std::uint32_t b, double cost);
  /// Finds the cut. \return per node whether it is on the second side.
  std::vector<std::uint8_t> solve();

 private:
  struct Arc {
    std::uint32_t to, next;
    double left;
  };
  void add_arc(std::uint32_t from, std::uint32_t to, double capacity);
  bool find_levels();
  double push(std::uint32_t at, double most);

  std::vector<Arc> arcs_;  ///< an arc and its reverse are neighbours
  std::vector<std::uint32_t> first_, current_;
  std::vector<std::int32_t> level_;
  std::vector<std::uint32_t> queue_;
  std::vector<double> first_cost_, second_cost_;
  std::uint32_t source_, sink_;
};

}  // namespace tribin::segmentation_detail
