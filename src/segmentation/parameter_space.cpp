#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "segmentation/spaces.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kGather = 8.0 * kDegree;  // rulings of one axis: a peak's width with its noise
constexpr int kWidths = 3;                 // kernels of 1, 2 and 3 rings for rulings of growing noise

/// sd of a ruling's direction [rad]: the off-diagonal noise of the shape operator over the difference of the
/// curvatures.
double sigma_ruling(const Surfels& s, std::uint32_t i) {
  return 0.5 * s.sigma_curvature[i] / std::max(1e-9f, std::abs(s.curvature1[i] - s.curvature2[i]));
}

/// One kernel step on the sphere: every bin shares its votes with those within 5 deg.
std::vector<float> spread(const DirectionBins& bins, const std::vector<float>& votes) {
  std::vector<float> out(votes.size(), 0.0f);
  for (std::size_t b = 0; b < votes.size(); ++b) {
    if (votes[b] == 0) continue;
    const auto ring = bins.neighbours(static_cast<int>(b));
    for (std::uint32_t k : ring) out[k] += votes[b] / static_cast<float>(ring.size());
  }
  return out;
}

/// A ruled surfel as parameter space sees it.
struct Ruled {
  std::uint32_t surfel;
  std::uint16_t bin;
  std::uint8_t width;        ///< which kernel
  float cos_gate, sin_gate;  ///< how far its ruling may lie from an axis: the peak's width and its own noise
  bool dead = false;         ///< of a peak that was looked at
};

std::vector<Ruled> ruled_surfels(const Scene& scene) {
  const Surfels& s = scene.surfels;
  const DirectionBins& bins = axis_bins();
  std::vector<Ruled> out;
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    if (!scene.free(i) || s.shape[i] != SurfelShape::ruled) continue;
    const double sigma = sigma_ruling(s, i);
    const double gate = kGather + 2.0 * std::min(sigma, 6 * kDegree);
    out.push_back({i, static_cast<std::uint16_t>(bins.find(s.direction2[i])),
                   static_cast<std::uint8_t>(sigma < 3 * kDegree   ? 0
                                             : sigma < 6 * kDegree ? 1
                                                                   : 2),
                   static_cast<float>(std::cos(gate)), static_cast<float>(std::sin(gate))});
  }
  return out;
}

/// Ruling votes of all that are still free, each with a kernel of its own width.
std::vector<float> vote_rulings(const Scene& scene, const std::vector<Ruled>& ruled) {
  const DirectionBins& bins = axis_bins();
  std::vector<float> by_width[kWidths];
  for (auto& v : by_width) v.assign(bins.center.size(), 0.0f);
  for (const Ruled& r : ruled)
    if (!r.dead && scene.free(r.surfel)) by_width[r.width][r.bin] += scene.surfels.area_mm2[r.surfel];
  std::vector<float> total = by_width[kWidths - 1];
  for (int w = kWidths - 1; w >= 0; --w) {
    total = spread(bins, total);
    if (w > 0)
      for (std::size_t b = 0; b < total.size(); ++b) total[b] += by_width[w - 1][b];
  }
  return total;
}

/// What explains each component, all seen with the labels as they are now: the heavy part of a peak, in parallel.
/// Ranges depend on the number of components alone.
std::vector<std::optional<FoundSurface>> explain_each(const Scene& scene, const std::vector<Indices>& components,
                                                      const Vec3& axis, const Limits& limits) {
  std::vector<std::optional<FoundSurface>> out(components.size());
  const int count = static_cast<int>(components.size());
  parallel_ranges(count, 1 + count / 16, [&](int begin, int end) {
    Scene own = scene.fork();
    for (int c = begin; c < end; ++c)
      out[static_cast<std::size_t>(c)] = explain_round(own, components[static_cast<std::size_t>(c)], axis, limits);
  });
  return out;
}

/// Whether an explanation made ahead is still the right one after others of its peak were taken: its surfels are free;
/// or it was none, and nothing that touches the component was taken.
bool still_holds(const Scene& scene, const Indices& component, const std::optional<FoundSurface>& ahead,
                 std::size_t found_before) {
  const Surfels& s = scene.surfels;
  if (ahead)
    return std::all_of(ahead->support.begin(), ahead->support.end(), [&](std::uint32_t i) { return scene.free(i); });
  const auto taken = [&](std::uint32_t i) { return scene.label[i] > static_cast<std::int32_t>(found_before); };
  for (std::uint32_t i : component) {
    if (taken(i)) return false;
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k)
      if (taken(s.neighbours[k])) return false;
  }
  return true;
}

}  // namespace

void fill_parameter_space(const Scene& scene, HoughSpaces& spaces) {
  if (spaces.parameter.empty()) spaces.parameter = vote_rulings(scene, ruled_surfels(scene));
}

void find_cylinders(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  const DirectionBins& bins = axis_bins();
  std::vector<Ruled> ruled = ruled_surfels(scene);
  fill_parameter_space(scene, spaces);
  const std::size_t least = std::max<std::size_t>(4, limits.min_surfels / 3);

  constexpr int kMaxPeaks = 400;  // each kills its members, so this only guards against a fault
  for (int round = 0; round < kMaxPeaks; ++round) {
    const std::vector<float> votes = vote_rulings(scene, ruled);
    const auto best = static_cast<std::size_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
    // The kernels spread a cylinder's votes over some twenty bins.
    if (votes[best] <= 0 || votes[best] < 0.02 * limits.min_area_mm2) break;
    Vec3 axis = bins.center[best].cast<double>();
    Indices members;
    double gathered = 0;
    for (int shift = 0; shift < 4; ++shift) {
      Matrix3 scatter = Matrix3::Zero();
      members.clear();
      gathered = 0;
      const Vec3f direction = axis.cast<float>();
      for (const Ruled& r : ruled) {
        const std::uint32_t i = r.surfel;
        if (r.dead || !scene.free(i) || std::abs(s.direction2[i].dot(direction)) < r.cos_gate) continue;
        if (std::abs(s.normal[i].dot(direction)) > r.sin_gate) continue;
        const Vec3 d = s.direction2[i].cast<double>();
        members.push_back(i);
        scatter += s.area_mm2[i] * d * d.transpose();
        gathered += s.area_mm2[i];
      }
      if (members.empty()) break;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(scatter)};
      axis = solver.eigenvectors().col(2);
    }
    if (axis.z() < 0) axis = -axis;
    HoughPeak peak;
    peak.parameter_space = true;
    peak.direction = axis;
    peak.votes = gathered;
    std::vector<Indices> all;
    for (int side = 0; side < 2; ++side) {  // convex and concave surfaces may touch: never one component
      Indices one_side;
      for (std::uint32_t i : members)
        if ((s.curvature1[i] > 0) == (side == 0)) one_side.push_back(i);
      for (Indices& component : components(scene, one_side, least)) all.push_back(std::move(component));
    }
    std::vector<std::optional<FoundSurface>> first = explain_each(scene, all, axis, limits);
    const std::size_t found_before = found.size();
    for (std::size_t c = 0; c < all.size(); ++c) {
      Indices& left = all[c];
      bool ahead = still_holds(scene, left, first[c], found_before);
      // A component may hold several cylinders: take the best, go on with the rest.
      while (left.size() >= least) {
        std::optional<FoundSurface> next = ahead ? std::move(first[c]) : explain_round(scene, left, axis, limits);
        ahead = false;
        if (!next) break;
        next->peak = static_cast<int>(spaces.peaks.size());
        take(scene, found, std::move(*next));
        std::erase_if(left, [&](std::uint32_t i) { return !scene.free(i); });
        const std::vector<Indices> parts = components(scene, left, least);
        left = parts.empty() ? Indices{} : parts.front();
      }
    }
    const bool any = found.size() > found_before;
    if (any) spaces.peaks.push_back(peak);
    if (members.empty()) break;
    std::size_t at = 0;  // members are in the order of `ruled`
    for (Ruled& r : ruled)
      if (at < members.size() && r.surfel == members[at]) r.dead = true, ++at;
  }
}

}  // namespace tribin::segmentation_detail
