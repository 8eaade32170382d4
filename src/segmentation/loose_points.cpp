#include "segmentation/loose_points.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace tribin::segmentation_detail {

void claim_points(Scene& scene, const std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  constexpr int kRounds = 20;  // rings of points that a surface may gain; edges and rims are one or two deep
  std::vector<std::int32_t> next(scene.label.begin(), scene.label.end());
  std::vector<std::size_t> size(found.size() + 1);
  for (int round = 0; round < kRounds; ++round) {
    std::fill(size.begin(), size.end(), 0);
    for (std::int32_t label : scene.label) ++size[static_cast<std::size_t>(label)];
    bool changed = false;
    for (std::uint32_t i = 0; i < s.size(); ++i) {
      const Vec3 p = s.position[i].cast<double>();
      const auto off = [&](std::int32_t label) {  // distance in sigmas; below 1 all are equally good
        const Surface& surface = found[static_cast<std::size_t>(label - 1)].fit.surface;
        return std::max(1.0, std::abs(surface.distance(p)) / s.sigma_mm[i]);
      };
      // Of those that explain it equally, the smallest: a point on an edge is a larger part of that one's rim.
      std::int32_t best = scene.label[i];
      double least = best > 0 ? off(best) : 4.0;
      for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
        const std::int32_t label = scene.label[s.neighbours[k]];
        if (label == 0 || label == best) continue;
        const double distance = off(label);
        const auto rank = [&](std::int32_t l) { return std::pair(size[static_cast<std::size_t>(l)], l); };
        if (distance < least || (distance == least && best > 0 && rank(label) < rank(best))) {
          least = distance;
          best = label;
        }
      }
      next[i] = best;
      changed |= best != scene.label[i];
    }
    std::copy(next.begin(), next.end(), scene.label.begin());
    if (!changed) break;
  }
}

namespace {

/// Joins touching pieces of one surface: nearly all of the smaller one lies on the larger one.
void join_same(Scene& scene, const std::vector<FoundSurface>& found) {
  constexpr double kNearlyAll = 0.95;
  const Surfels& s = scene.surfels;
  std::vector<Indices> support(found.size());
  for (std::uint32_t i = 0; i < s.size(); ++i)
    if (!scene.free(i)) support[static_cast<std::size_t>(scene.label[i] - 1)].push_back(i);
  std::set<std::pair<std::size_t, std::size_t>> touching;  // smaller, larger
  for (std::uint32_t i = 0; i < s.size(); ++i)
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::int32_t a = scene.label[i], b = scene.label[s.neighbours[k]];
      if (a == 0 || b == 0 || a == b) continue;
      const auto p = static_cast<std::size_t>(a - 1), q = static_cast<std::size_t>(b - 1);
      if (found[p].fit.surface.type != found[q].fit.surface.type) continue;
      if (std::pair(support[p].size(), p) < std::pair(support[q].size(), q)) touching.emplace(p, q);
    }
  std::vector<std::size_t> into(found.size());
  for (std::size_t f = 0; f < into.size(); ++f) into[f] = f;
  for (const auto& [p, touched] : touching) {
    std::size_t q = touched;
    while (into[q] != q) q = into[q];
    if (q == p || into[p] != p) continue;
    std::size_t on = 0;
    for (std::uint32_t i : support[p]) on += std::abs(misfit(s, i, found[q].fit.surface)) < 4.0 * s.sigma_mm[i];
    if (static_cast<double>(on) >= kNearlyAll * static_cast<double>(support[p].size())) into[p] = q;
  }
  for (std::int32_t& label : scene.label) {
    if (label == 0) continue;
    auto f = static_cast<std::size_t>(label - 1);
    while (into[f] != f) f = into[f];
    label = static_cast<std::int32_t>(f + 1);
  }
}

}  // namespace

void explain_rest(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found) {
  constexpr int kRounds = 8;  // each explains what the one before laid bare
  for (int round = 0; round < kRounds; ++round) {
    claim_points(scene, found);
    Indices rest;
    for (std::uint32_t i = 0; i < scene.label.size(); ++i)
      if (scene.free(i)) rest.push_back(i);
    if (rest.size() < limits.min_surfels) break;
    const Surfels again = surfels_among(scene.surfels, rest);
    Scene part(again);
    part.cell_mm = scene.cell_mm;
    std::vector<FoundSurface> more;
    explain(part, limits, spaces, more);
    if (more.empty()) break;
    for (FoundSurface& surface : more) {
      for (std::uint32_t& i : surface.support) i = rest[i];
      take(scene, found, std::move(surface));
    }
  }
  join_same(scene, found);
  claim_points(scene, found);
}

}  // namespace tribin::segmentation_detail
