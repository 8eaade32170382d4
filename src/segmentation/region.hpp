#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "segmentation/fitting.hpp"

namespace tribin::segmentation_detail {

/// The surfels and what explains them so far; the scratch marks save an allocation per region.
struct Scene {
  const Surfels& surfels;
  std::span<std::int32_t> label;  ///< id of the primitive, 0 = still free
  std::vector<std::uint32_t> mark;
  std::uint32_t tick = 0;
  double cell_mm = 0;  ///< typical spacing of surfels, for gaps: sqrt of the median area

  explicit Scene(const Surfels& s);
  /// The same labels with marks of its own, for a task that only reads labels. Must not outlive this one.
  Scene fork() const;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  bool free(std::uint32_t i) const { return label[i] == 0; }

 private:
  explicit Scene(const Scene* of);
  std::vector<std::int32_t> labels_;
};

/// Connected components of `members`, largest first. Components bridge one rejected cell where both sides lie on one
/// smooth surface: their offset along the mean normal is below 0.15 cell + 3 sigma.
/// \source algorithms.md section 15: components first, merge later.
std::vector<Indices> components(Scene& scene, std::span<const std::uint32_t> members, std::size_t least);

/// Free surfels that lie on the surface and hang together with `seed` (which is kept where it fits). A surfel fits
/// within 4 sigma * scale and where its normal agrees within 4 sigma and `slack` rad.
Indices grow(Scene& scene, const Surface& surface, std::span<const std::uint32_t> seed, double scale, double slack);

/// Whether one surfel fits: the test of grow().
bool fits(const Surfels& surfels, std::uint32_t i, const Surface& surface, double scale, double slack);

/// Correlation of neighbouring residuals in a support: about 0 for noise, towards 1 where the surface has another
/// shape.
double residual_correlation(Scene& scene, std::span<const std::uint32_t> support, const Surface& surface);

/// How the support ends: share of its rim that goes on smoothly into free surfels. Primitives end at edges; a patch cut
/// out of a free-form surface does not.
double smooth_rim_share(Scene& scene, std::span<const std::uint32_t> support);

double area_of(const Surfels& surfels, std::span<const std::uint32_t> support);

}  // namespace tribin::segmentation_detail
