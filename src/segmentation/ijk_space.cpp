#include <algorithm>
#include <cmath>

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kPlaneSlack = 2.0 * kDegree;  // systematic tilt of normals beside edges
constexpr double kPeakWidth = 5.0 * kDegree;   // of the kernel: about two bins

/// Surfels of one direction, by bin.
struct Binned {
  std::vector<std::uint32_t> begin;
  std::vector<std::uint32_t> members;
  std::vector<std::int32_t> bin_of;  ///< per surfel, -1 = votes not
};

Binned bin_normals(const Scene& scene, PlaneVoters voters, const DirectionBins& bins, std::vector<float>& votes) {
  const Surfels& s = scene.surfels;
  Binned out;
  std::vector<std::int32_t>& bin_of = out.bin_of;
  bin_of.assign(s.size(), -1);
  out.begin.assign(bins.center.size() + 1, 0);
  votes.assign(bins.center.size(), 0.0f);
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    if (!scene.free(i)) continue;
    const bool undecided = s.shape[i] == SurfelShape::unknown && voters == PlaneVoters::flat_and_undecided;
    if (s.shape[i] != SurfelShape::flat && !undecided) continue;
    bin_of[i] = bins.find(s.normal[i]);
    votes[bin_of[i]] += s.area_mm2[i];
    ++out.begin[bin_of[i] + 1];
  }
  for (std::size_t b = 0; b < bins.center.size(); ++b) out.begin[b + 1] += out.begin[b];
  out.members.resize(out.begin.back());
  std::vector<std::uint32_t> at(out.begin.begin(), out.begin.end() - 1);
  for (std::uint32_t i = 0; i < s.size(); ++i)
    if (bin_of[i] >= 0) out.members[at[bin_of[i]]++] = i;
  return out;
}

/// A mesh is exact: the component's largest triangle gives the plane, and nothing may pull at it.
Indices seed_of(const Surfels& s, const Indices& component) {
  if (s.mesh == nullptr) return component;
  return {*std::max_element(component.begin(), component.end(),
                            [&](std::uint32_t a, std::uint32_t b) { return s.area_mm2[a] < s.area_mm2[b]; })};
}

std::optional<FoundSurface> explain_plane(Scene& scene, const Indices& whole, PlaneVoters voters,
                                          const Limits& limits) {
  const Indices component = seed_of(scene.surfels, whole);
  Fit fit = fit_plane(scene.surfels, component);
  if (!fit.valid) return std::nullopt;
  FoundSurface out;
  std::size_t before = 0;
  for (int round = 0; round < 3; ++round) {
    out.support = grow(scene, fit.surface, component, fit.scale, kPlaneSlack);
    if (out.support.size() < limits.min_surfels) return std::nullopt;
    fit = fit_plane(scene.surfels, out.support);
    if (!fit.valid) return std::nullopt;
    // What a large plane takes up hardly changes after the first time.
    const std::size_t change = std::max(before, out.support.size()) - std::min(before, out.support.size());
    if (change * 200 < out.support.size()) break;
    before = out.support.size();
  }
  // The support must hold the plane's direction: strips one cell wide do not.
  if (scene.surfels.mesh == nullptr && std::sqrt(fit.covariance.topLeftCorner<2, 2>().trace()) > 3.0 * kDegree)
    return std::nullopt;
  if (area_of(scene.surfels, out.support) < limits.min_area_mm2) return std::nullopt;
  if (scene.surfels.mesh == nullptr && voters == PlaneVoters::flat_and_undecided &&
      curvature_bound(scene.surfels, out.support, fit) > 0.7 / scene.surfels.max_radius_mm)
    return std::nullopt;
  out.fit = fit;
  return out;
}

}  // namespace

void take(Scene& scene, std::vector<FoundSurface>& found, FoundSurface&& next) {
  const auto id = static_cast<std::int32_t>(found.size() + 1);
  for (std::uint32_t i : next.support) scene.label[i] = id;
  found.push_back(std::move(next));
}

void find_planes(Scene& scene, const Limits& limits, PlaneVoters voters, HoughSpaces& spaces,
                 std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  const DirectionBins& bins = ijk_bins();
  std::vector<float> votes;
  const Binned binned = bin_normals(scene, voters, bins, votes);
  std::vector<float> smooth(votes.size(), 0.0f);
  const auto smooth_at = [&](std::size_t b) {
    float sum = 0;
    for (std::uint32_t k : bins.neighbours(static_cast<int>(b))) sum += votes[k];
    smooth[b] = sum;
  };
  for (std::size_t b = 0; b < votes.size(); ++b) smooth_at(b);

  const std::size_t least = s.mesh != nullptr ? 1 : std::max<std::size_t>(3, limits.min_surfels / 3);
  std::vector<std::uint8_t> dead(s.size(), 0);
  Indices members;
  for (;;) {
    const auto best = static_cast<int>(std::max_element(smooth.begin(), smooth.end()) - smooth.begin());
    if (smooth[best] < 0.5 * limits.min_area_mm2 || smooth[best] <= 0) break;
    // Mean shift to the exact mode; then all surfels of the direction, either side.
    Vec3 direction = bins.center[best].cast<double>();
    double gathered = 0;
    for (int round = 0; round < 3; ++round) {
      Vec3 sum = Vec3::Zero();
      const auto gather = [&](double width) {
        members.clear();
        gathered = 0;
        for (std::uint32_t ring : bins.neighbours(bins.find(direction.cast<float>())))
          for (std::uint32_t k = binned.begin[ring]; k < binned.begin[ring + 1]; ++k) {
            const std::uint32_t i = binned.members[k];
            const Vec3 n = s.normal[i].cast<double>();
            const double dot = n.dot(direction);
            if (!scene.free(i) || dead[i] || std::abs(dot) < std::cos(width)) continue;
            members.push_back(i);
            sum += n * (dot > 0 ? s.area_mm2[i] : -s.area_mm2[i]);
            gathered += s.area_mm2[i];
          }
      };
      gather(kPeakWidth);
      // Exact normals all vote in one bin: then the peak may be any bin of its ring, further off than the width.
      if (members.empty() && round == 0) gather(0.5 * kPi);
      if (members.empty()) break;
      direction = sum.normalized();
    }
    HoughPeak peak;
    peak.direction = direction;
    peak.d = 1;
    peak.votes = gathered;
    const int peak_index = static_cast<int>(spaces.peaks.size());

    const std::size_t found_before = found.size();
    bool any = false;
    for (int side = 0; side < 2; ++side) {
      Indices one_side;
      for (std::uint32_t i : members) {
        const bool front = !s.oriented || s.normal[i].cast<double>().dot(direction) > 0;
        if (front == (side == 0)) one_side.push_back(i);
      }
      std::sort(one_side.begin(), one_side.end());
      for (const Indices& component : components(scene, one_side, least)) {
        Indices left = component;
        for (;;) {  // a component may hold several planes a few degrees apart
          std::erase_if(left, [&](std::uint32_t i) { return !scene.free(i); });
          if (left.size() < least) break;
          std::optional<FoundSurface> plane = explain_plane(scene, left, voters, limits);
          if (!plane) break;
          plane->peak = peak_index;
          any = true;
          take(scene, found, std::move(*plane));
        }
      }
    }
    if (any) spaces.peaks.push_back(peak);
    // What was looked at votes no more, explained or not; nor does what became explained.
    // The whole of the bins that made the peak, so that each peak ends some votes.
    const bool nothing_near = members.empty();  // all lie just outside of the kernel: they are done with too
    for (std::uint32_t b : bins.neighbours(best))
      for (std::uint32_t k = binned.begin[b]; k < binned.begin[b + 1]; ++k)
        if (nothing_near || b == static_cast<std::uint32_t>(best)) members.push_back(binned.members[k]);
    std::vector<std::uint32_t> changed;
    for (std::uint32_t i : members) {
      dead[i] = 1;
      changed.push_back(static_cast<std::uint32_t>(binned.bin_of[i]));
    }
    for (std::size_t f = found_before; f < found.size(); ++f)
      for (std::uint32_t i : found[f].support)
        if (binned.bin_of[i] >= 0) changed.push_back(static_cast<std::uint32_t>(binned.bin_of[i]));
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    for (std::uint32_t b : changed) {
      votes[b] = 0;
      for (std::uint32_t k = binned.begin[b]; k < binned.begin[b + 1]; ++k) {
        const std::uint32_t i = binned.members[k];
        if (scene.free(i) && !dead[i]) votes[b] += s.area_mm2[i];
      }
    }
    std::vector<std::uint32_t> around;
    for (std::uint32_t b : changed)
      for (std::uint32_t k : bins.neighbours(static_cast<int>(b))) around.push_back(k);
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    for (std::uint32_t b : around) smooth_at(b);
  }
}

}  // namespace tribin::segmentation_detail
