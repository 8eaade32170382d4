#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "segmentation/spaces.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kWidth = 4.0 * kDegree;  // of a vote: an IJK bin and an axis bin are 2.2 and 3.2 deg wide
constexpr int kPoles = 3;                 // tries per component: two surfaces may share one, and noise may win once
constexpr int kPasses = 3;                // what a success leaves is looked at again

/// What a component's normals say of an axis.
struct Pole {
  Vec3 axis = Vec3::UnitZ();
  Indices members;      ///< surfels whose normals lie on the great circle
  double area_mm2 = 0;  ///< of the members
  bool spread = false;  ///< the normals fill an arc of the circle, not just a point of it
};

/// Width of the votes of a component [rad]: the bins and its normals' own noise.
double width_of(const Surfels& s, const Indices& component) {
  std::vector<float> sigma;
  sigma.reserve(component.size());
  for (std::uint32_t i : component) sigma.push_back(s.sigma_normal[i]);
  std::nth_element(sigma.begin(), sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2), sigma.end());
  return kWidth + 2.0 * std::min<double>(sigma[sigma.size() / 2], 4.0 * kDegree);
}

/// Great circles of the component's normals: bins of IJK space vote for all axes across them, with 1 - (n.a / s)^2.
std::vector<float> vote_circles(const Surfels& s, const Indices& component, double width) {
  const DirectionBins &normals = ijk_bins(), &axes = axis_bins();
  std::vector<float> weight(normals.center.size(), 0.0f);
  for (std::uint32_t i : component) weight[static_cast<std::size_t>(normals.find(s.normal[i]))] += s.area_mm2[i];
  std::vector<float> votes(axes.center.size(), 0.0f);
  const float inverse = static_cast<float>(1.0 / std::pow(std::sin(width), 2));
  for (std::size_t b = 0; b < weight.size(); ++b) {
    if (weight[b] == 0) continue;
    const Vec3f n = normals.center[b];
    for (std::size_t a = 0; a < votes.size(); ++a) {
      const float dot = n.dot(axes.center[a]);
      votes[a] += weight[b] * std::max(0.0f, 1.0f - dot * dot * inverse);
    }
  }
  return votes;
}

/// The pole near `axis` by repeated least squares: the direction that its great circle's normals have least of.
Pole refine(const Surfels& s, const Indices& component, Vec3 axis, double width) {
  Pole pole;
  const double limit = std::sin(width);
  for (int round = 0; round < 4; ++round) {
    Matrix3 scatter = Matrix3::Zero();
    pole.members.clear();
    pole.area_mm2 = 0;
    for (std::uint32_t i : component) {
      const Vec3 n = s.normal[i].cast<double>();
      if (std::abs(n.dot(axis)) > limit) continue;
      pole.members.push_back(i);
      pole.area_mm2 += s.area_mm2[i];
      scatter += s.area_mm2[i] * n * n.transpose();
    }
    if (pole.members.empty()) return pole;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(scatter)};
    axis = solver.eigenvectors().col(0);
    // Along the circle the normals must vary more than the noise lets them vary across it.
    pole.spread = solver.eigenvalues()[1] > 4.0 * solver.eigenvalues()[0];
  }
  pole.axis = axis.z() < 0 ? Vec3(-axis) : axis;
  return pole;
}

struct Circle {
  FoundSurface surface;
  HoughPeak peak;
};

/// The best surface of revolution about a pole of the component's normals.
std::optional<Circle> explain_by_circles(Scene& scene, const Indices& component, const Limits& limits) {
  const Surfels& s = scene.surfels;
  const DirectionBins& axes = axis_bins();
  const double width = width_of(s, component);
  std::vector<float> votes = vote_circles(s, component, width);
  for (int attempt = 0; attempt < kPoles; ++attempt) {
    const auto best = static_cast<std::size_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
    if (votes[best] < 0.5 * limits.min_area_mm2) return std::nullopt;
    const Pole pole = refine(s, component, axes.center[best].cast<double>(), width);
    if (pole.spread && pole.area_mm2 >= limits.min_area_mm2)
      for (const Indices& part : components(scene, pole.members, limits.min_surfels)) {
        std::optional<FoundSurface> surface = explain_round(scene, part, pole.axis, limits);
        if (!surface) continue;
        HoughPeak peak;
        peak.parameter_space = true;
        peak.direction = pole.axis;
        peak.votes = pole.area_mm2;
        return Circle{std::move(*surface), peak};
      }
    for (std::uint32_t b : axes.neighbours(static_cast<int>(best))) votes[b] = 0;
    for (std::uint32_t b : axes.neighbours(axes.find(pole.axis.cast<float>()))) votes[b] = 0;
  }
  return std::nullopt;
}

}  // namespace

void find_by_great_circles(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  Indices left;
  for (std::uint32_t i = 0; i < s.size(); ++i)
    if (scene.free(i)) left.push_back(i);
  for (int pass = 0; pass < kPasses && !left.empty(); ++pass) {
    const std::vector<Indices> all = components(scene, left, limits.min_surfels);
    std::vector<std::optional<Circle>> circles(all.size());
    const int count = static_cast<int>(all.size());
    parallel_ranges(count, 1 + count / 32, [&](int begin, int end) {
      Scene own = scene.fork();
      for (int c = begin; c < end; ++c) {
        const auto at = static_cast<std::size_t>(c);
        circles[at] = explain_by_circles(own, all[at], limits);
      }
    });
    left.clear();
    for (std::size_t c = 0; c < all.size(); ++c) {
      if (!circles[c]) continue;
      FoundSurface& next = circles[c]->surface;
      const bool still_free =
          std::all_of(next.support.begin(), next.support.end(), [&](std::uint32_t i) { return scene.free(i); });
      if (still_free) {
        next.peak = static_cast<int>(spaces.peaks.size());
        spaces.peaks.push_back(circles[c]->peak);
        take(scene, found, std::move(next));
      }
      for (std::uint32_t i : all[c])
        if (scene.free(i)) left.push_back(i);
    }
  }
}

}  // namespace tribin::segmentation_detail
