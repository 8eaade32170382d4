#include "segmentation/min_cut.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::segmentation_detail {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr double kSpent = 1e-9;  // nats: a capacity below is none, so that rounding makes no paths

}  // namespace

MinCut::MinCut(std::size_t nodes)
    : first_(nodes + 2, kNone),
      first_cost_(nodes, 0.0),
      second_cost_(nodes, 0.0),
      source_(static_cast<std::uint32_t>(nodes)),
      sink_(static_cast<std::uint32_t>(nodes + 1)) {}

void MinCut::add_node(std::uint32_t i, double first, double second) {
  first_cost_[i] += first;
  second_cost_[i] += second;
}

void MinCut::add_arc(std::uint32_t from, std::uint32_t to, double capacity) {
  arcs_.push_back({to, first_[from], capacity});
  first_[from] = static_cast<std::uint32_t>(arcs_.size() - 1);
}

void MinCut::add_edge(std::uint32_t a, std::uint32_t b, double cost) {
  add_arc(a, b, cost);
  add_arc(b, a, 0);
}

bool MinCut::find_levels() {
  level_.assign(first_.size(), -1);
  queue_.assign(1, source_);
  level_[source_] = 0;
  for (std::size_t at = 0; at < queue_.size(); ++at)
    for (std::uint32_t e = first_[queue_[at]]; e != kNone; e = arcs_[e].next) {
      if (arcs_[e].left <= kSpent || level_[arcs_[e].to] >= 0) continue;
      level_[arcs_[e].to] = level_[queue_[at]] + 1;
      queue_.push_back(arcs_[e].to);
    }
  return level_[sink_] >= 0;
}

double MinCut::push(std::uint32_t at, double most) {
  if (at == sink_) return most;
  double pushed = 0;
  for (std::uint32_t& e = current_[at]; e != kNone; e = arcs_[e].next) {
    Arc& arc = arcs_[e];
    if (arc.left <= kSpent || level_[arc.to] != level_[at] + 1) continue;
    const double step = push(arc.to, std::min(most - pushed, arc.left));
    arc.left -= step;
    arcs_[e ^ 1u].left += step;
    pushed += step;
    if (most - pushed <= kSpent) return pushed;
  }
  return pushed;
}

std::vector<std::uint8_t> MinCut::solve() {
  for (std::uint32_t i = 0; i < source_; ++i) {
    const double least = std::min(first_cost_[i], second_cost_[i]);
    if (second_cost_[i] > least) add_edge(source_, i, second_cost_[i] - least);
    if (first_cost_[i] > least) add_edge(i, sink_, first_cost_[i] - least);
  }
  while (find_levels()) {
    current_ = first_;
    push(source_, HUGE_VAL);
  }
  std::vector<std::uint8_t> second(source_);
  for (std::uint32_t i = 0; i < source_; ++i) second[i] = level_[i] < 0;
  return second;
}

}  // namespace tribin::segmentation_detail
