#include "segmentation/labelling.hpp"

#include <algorithm>
#include <cmath>

#include "segmentation/min_cut.hpp"

namespace tribin::segmentation_detail {

double Labelling::place_cost(std::uint32_t i, const Surface& surface) const {
  const double e = surface.distance(surfels.position[i].cast<double>()) / surfels.sigma_mm[i];
  return 0.5 * precision * e * e;
}

Labelling::Labelling(const Surfels& s, double edge_cost)
    : surfels(s), edge(edge_cost), label(s.size(), -1), misfit(s.size(), kUnexplained), place_(s.size(), -1) {}

std::vector<Indices> Labelling::supports() const {
  std::vector<Indices> out(models.size());
  for (std::uint32_t i = 0; i < label.size(); ++i)
    if (label[i] >= 0) out[static_cast<std::size_t>(label[i])].push_back(i);
  return out;
}

void Labelling::replace(std::size_t model, const Model& by) {
  models[model] = by;
  for (std::uint32_t i = 0; i < label.size(); ++i) {
    if (label[i] != static_cast<std::int32_t>(model)) continue;
    misfit[i] = place_cost(i, by.surface);
    if (misfit[i] <= kUnexplained) continue;
    misfit[i] = kUnexplained;
    label[i] = -1;
    --count[model];
  }
}

double Labelling::energy() const {
  double sum = 0;
  for (std::uint32_t i = 0; i < label.size(); ++i) {
    sum += misfit[i];
    for (std::uint32_t k = surfels.neighbour_begin[i]; k < surfels.neighbour_begin[i + 1]; ++k)
      if (surfels.neighbours[k] > i && label[surfels.neighbours[k]] != label[i]) sum += edge;
  }
  for (std::size_t m = 0; m < models.size(); ++m)
    if (count[m] > 0) sum += models[m].cost;
  return sum;
}

double expand(Labelling& l, const Model& model, std::span<const std::uint32_t> from, std::int32_t as) {
  const Surfels& s = l.surfels;
  const auto has = [&](std::uint32_t i) { return as >= 0 && l.label[i] == as; };
  // The points that may take it: on the surface and hanging together; those that have it are asked again.
  Indices region;
  std::vector<double> cost;
  const auto consider = [&](std::uint32_t i, bool anyway) {
    if (l.place_[i] >= 0) return;
    const double c = l.place_cost(i, model.surface);
    if (c > Labelling::kUnexplained && !anyway) return;
    l.place_[i] = static_cast<std::int32_t>(region.size());
    region.push_back(i);
    cost.push_back(std::min(c, Labelling::kUnexplained));
  };
  // Those that speak for it may take it wherever they lie, or one that lies far off would keep its old model alive.
  for (std::uint32_t i : from) consider(i, true);
  for (std::size_t at = 0; at < region.size(); ++at)
    for (std::uint32_t k = s.neighbour_begin[region[at]]; k < s.neighbour_begin[region[at] + 1]; ++k)
      consider(s.neighbours[k], false);
  struct Tidy {
    std::vector<std::int32_t>& place;
    const Indices& region;
    ~Tidy() {
      for (std::uint32_t i : region) place[i] = -1;
    }
  } tidy{l.place_, region};

  // Models that lie wholly inside may go.
  std::vector<std::pair<std::int32_t, std::uint32_t>> inside;  // label, points
  for (std::uint32_t i : region)
    if (l.label[i] >= 0 && l.label[i] != as) inside.emplace_back(l.label[i], 1);
  std::sort(inside.begin(), inside.end());
  std::size_t kinds = 0;
  for (const auto& [label, one] : inside) {
    if (kinds > 0 && inside[kinds - 1].first == label)
      inside[kinds - 1].second += one;
    else
      inside[kinds++] = {label, one};
  }
  inside.resize(kinds);
  std::erase_if(inside, [&](const auto& p) { return l.count[static_cast<std::size_t>(p.first)] != p.second; });

  // What could be saved at best; most offers end here.
  const bool is_new = as < 0 || l.count[static_cast<std::size_t>(as)] == 0;
  double most = is_new ? -model.cost : 0;
  for (const auto& [label, points] : inside) most += l.models[static_cast<std::size_t>(label)].cost;
  for (std::size_t n = 0; n < region.size(); ++n) {
    const std::uint32_t i = region[n];
    if (has(i)) continue;
    double saved = l.misfit[i] - cost[n];
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k)
      if (l.label[s.neighbours[k]] != l.label[i]) saved += l.place_[s.neighbours[k]] >= 0 ? 0.5 * l.edge : l.edge;
    most += std::max(0.0, saved);
  }
  if (most <= 1e-6) return 0;

  // First side: keeps its label. Second: takes the model.
  MinCut cut(region.size() + inside.size() + 1);
  for (std::uint32_t n = 0; n < region.size(); ++n) {
    const std::uint32_t i = region[n];
    if (has(i)) {
      cut.add_node(n, 1e12, 0);
      // Its neighbours' edges are counted from their side.
    } else {
      cut.add_node(n, l.misfit[i], cost[n]);
    }
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      const std::int32_t m = l.place_[j];
      if (m < 0) {
        cut.add_node(n, l.label[j] != l.label[i] ? l.edge : 0, has(j) ? 0 : l.edge);
        continue;
      }
      if (j < i) continue;
      const double apart = l.label[i] != l.label[j] ? l.edge : 0;
      const double only_j = has(i) ? 0 : l.edge, only_i = has(j) ? 0 : l.edge;
      cut.add_node(n, 0, only_i - apart);
      cut.add_node(static_cast<std::uint32_t>(m), 0, -only_i);
      // Both keep: apart; only j takes: only_j; only i takes: only_i; both take: nothing.
      cut.add_node(n, apart, apart);
      if (only_i + only_j - apart > 0) cut.add_edge(n, static_cast<std::uint32_t>(m), only_i + only_j - apart);
    }
  }
  for (std::size_t k = 0; k < inside.size(); ++k) {
    const auto node = static_cast<std::uint32_t>(region.size() + k);
    cut.add_node(node, l.models[static_cast<std::size_t>(inside[k].first)].cost, 0);
    for (std::uint32_t n = 0; n < region.size(); ++n)
      if (l.label[region[n]] == inside[k].first) cut.add_edge(n, node, 1e12);
  }
  const auto own = static_cast<std::uint32_t>(region.size() + inside.size());
  if (is_new) {
    cut.add_node(own, 0, model.cost);
    for (std::uint32_t n = 0; n < region.size(); ++n) cut.add_edge(own, n, 1e12);
  }
  const std::vector<std::uint8_t> takes = cut.solve();

  // What that saves, counted anew.
  const auto label_of = [&](std::uint32_t i) {
    const std::int32_t n = l.place_[i];
    return n >= 0 && takes[static_cast<std::size_t>(n)] != 0 ? -2 : (has(i) ? -2 : l.label[i]);
  };
  double saved = 0;
  std::size_t taken = 0;
  std::vector<std::uint32_t> lost(inside.size(), 0);
  for (std::size_t n = 0; n < region.size(); ++n) {
    const std::uint32_t i = region[n];
    const bool takes_it = takes[n] != 0 && !has(i);
    if (!takes_it) continue;
    ++taken;
    saved += l.misfit[i] - cost[n];
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      const bool both = l.place_[j] >= 0 && takes[static_cast<std::size_t>(l.place_[j])] != 0 && !has(j);
      const double before = l.label[i] != l.label[j] ? l.edge : 0, after = label_of(j) != -2 ? l.edge : 0;
      saved += (before - after) * (both ? 0.5 : 1.0);
    }
    for (std::size_t k = 0; k < inside.size(); ++k) lost[k] += l.label[i] == inside[k].first;
  }
  for (std::size_t k = 0; k < inside.size(); ++k)
    if (lost[k] == inside[k].second) saved += l.models[static_cast<std::size_t>(inside[k].first)].cost;
  if (is_new) saved -= model.cost;
  if (taken == 0 || saved <= 1e-6) return 0;

  if (as < 0) {
    as = static_cast<std::int32_t>(l.models.size());
    l.models.push_back(model);
    l.count.push_back(0);
  }
  for (std::size_t n = 0; n < region.size(); ++n) {
    const std::uint32_t i = region[n];
    if (takes[n] == 0 || l.label[i] == as) continue;
    if (l.label[i] >= 0) --l.count[static_cast<std::size_t>(l.label[i])];
    l.label[i] = as;
    l.misfit[i] = cost[n];
    ++l.count[static_cast<std::size_t>(as)];
  }
  return saved;
}

}  // namespace tribin::segmentation_detail
