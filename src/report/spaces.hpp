#pragma once

#include <string>
#include <vector>

#include "tribin/segmentation/primitives.hpp"

namespace tribin::report {

inline constexpr int kVoteColours = 12;  ///< CSS classes m0 .. m11 of the page's style

/// A peak to be ringed, with its label.
struct PeakMark {
  Vec3 direction = Vec3::UnitZ();
  std::string label;
  std::vector<std::string> keys;  ///< of the primitives that it stands for (links.hpp)
};
/// A circle that normals draw on the sphere: all n with dot(axis, n) = d.
struct CircleMark {
  Vec3 axis = Vec3::UnitZ();
  double d = 0;
  std::string label;
  std::string type;               ///< CSS class: cylinder, cone
  std::vector<std::string> keys;  ///< as of a peak
};

/// Area of the surfels' normals (as axes: z >= 0) in the bins of a golden spiral.
std::vector<float> count_normals(const Surfels& surfels, const std::vector<std::uint32_t>& which, int bins);

/// The half sphere, tilted by 30 degrees, as inline SVG: size and colour of a bin by the cube root of its count.
std::string sphere_svg(const std::vector<float>& bins, const std::vector<PeakMark>& peaks,
                       const std::vector<CircleMark>& circles, const std::string& title);

/// The half sphere of axes as an equal-area disc: colour by the logarithm of the votes.
std::string disc_svg(const std::vector<float>& bins, const std::vector<PeakMark>& peaks, const std::string& title);

}  // namespace tribin::report
