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
};

Binned bin_flat(const Scene& scene, const DirectionBins& bins, std::vector<float>& votes) {
  const Surfels& s = scene.surfels;
  Binned out;
  std::vector<std::int32_t> bin_of(s.size(), -1);
  out.begin.assign(bins.center.size() + 1, 0);
  votes.assign(bins.center.size(), 0.0f);
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    if (!scene.free(i) || s.shape[i] != SurfelShape::flat) continue;
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

std::optional<Found> explain_plane(Scene& scene, const Indices& component, const Limits& limits) {
  Fit fit = fit_plane(scene.surfels, component);
  if (!fit.valid) return std::nullopt;
  Found out;
  for (int round = 0; round < 3; ++round) {
    out.support = grow(scene, fit.surface, component, fit.scale, kPlaneSlack);
    if (out.support.size() < limits.min_surfels) return std::nullopt;
    fit = fit_plane(scene.surfels, out.support);
    if (!fit.valid) return std::nullopt;
  }
  // The support must hold the plane's direction: strips one cell wide do not.
  if (std::sqrt(fit.covariance.topLeftCorner<2, 2>().trace()) > 3.0 * kDegree) return std::nullopt;
  if (area_of(scene.surfels, out.support) < limits.min_area_mm2) return std::nullopt;
  out.fit = fit;
  return out;
}

}  // namespace

void take(Scene& scene, std::vector<Found>& found, Found&& next) {
  const auto id = static_cast<std::int32_t>(found.size() + 1);
  for (std::uint32_t i : next.support) scene.label[i] = id;
  found.push_back(std::move(next));
}

void find_planes(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<Found>& found) {
  const Surfels& s = scene.surfels;
  const DirectionBins& bins = ijk_bins();
  std::vector<float> votes;
  const Binned binned = bin_flat(scene, bins, votes);
  std::vector<float> smooth(votes.size(), 0.0f);
  const auto smooth_at = [&](std::size_t b) {
    float sum = 0;
    for (std::uint32_t k : bins.neighbours(static_cast<int>(b))) sum += votes[k];
    smooth[b] = sum;
  };
  for (std::size_t b = 0; b < votes.size(); ++b) smooth_at(b);

  Indices members;
  for (;;) {
    const auto best = static_cast<int>(std::max_element(smooth.begin(), smooth.end()) - smooth.begin());
    if (smooth[best] < 0.5 * limits.min_area_mm2 || smooth[best] <= 0) break;
    // Mean shift to the exact mode; then all surfels of the direction, either side.
    Vec3 direction = bins.center[best].cast<double>();
    double gathered = 0;
    for (int round = 0; round < 3; ++round) {
      Vec3 sum = Vec3::Zero();
      members.clear();
      gathered = 0;
      for (std::uint32_t ring : bins.neighbours(bins.find(direction.cast<float>())))
        for (std::uint32_t k = binned.begin[ring]; k < binned.begin[ring + 1]; ++k) {
          const std::uint32_t i = binned.members[k];
          const Vec3 n = s.normal[i].cast<double>();
          const double dot = n.dot(direction);
          if (!scene.free(i) || std::abs(dot) < std::cos(kPeakWidth)) continue;
          members.push_back(i);
          sum += n * (dot > 0 ? s.area_mm2[i] : -s.area_mm2[i]);
          gathered += s.area_mm2[i];
        }
      if (members.empty()) break;
      direction = sum.normalized();
    }
    HoughPeak peak;
    peak.direction = direction;
    peak.d = 1;
    peak.votes = gathered;
    const int peak_index = static_cast<int>(spaces.peaks.size());

    bool any = false;
    for (int side = 0; side < 2; ++side) {
      Indices one_side;
      for (std::uint32_t i : members)
        if ((s.normal[i].cast<double>().dot(direction) > 0) == (side == 0)) one_side.push_back(i);
      std::sort(one_side.begin(), one_side.end());
      for (const Indices& component : components(scene, one_side, std::max<std::size_t>(3, limits.min_surfels / 3))) {
        Indices still_free;
        for (std::uint32_t i : component)
          if (scene.free(i)) still_free.push_back(i);
        if (still_free.size() < std::max<std::size_t>(3, limits.min_surfels / 3)) continue;
        std::optional<Found> plane = explain_plane(scene, still_free, limits);
        if (!plane) continue;
        plane->peak = peak_index;
        any = true;
        take(scene, found, std::move(*plane));
      }
    }
    if (any) spaces.peaks.push_back(peak);
    // What was looked at votes no more, explained or not.
    for (std::uint32_t i : members) votes[bins.find(s.normal[i])] = 0;
    votes[best] = 0;
    for (std::size_t b = 0; b < votes.size(); ++b) {
      if (votes[b] > 0) {
        float left = 0;
        for (std::uint32_t k = binned.begin[b]; k < binned.begin[b + 1]; ++k)
          if (scene.free(binned.members[k])) left += s.area_mm2[binned.members[k]];
        votes[b] = left;
      }
    }
    for (std::size_t b = 0; b < votes.size(); ++b) smooth_at(b);
  }
}

}  // namespace tribin::segmentation_detail
