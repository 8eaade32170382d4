#pragma once

#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin {

/// Does a part that was found look as its CAD says it should?
enum class QualityDecision : std::uint8_t {
  not_checked,  ///< too little of it was measured, or its pose is not told
  nominal,      ///< what was measured agrees with the CAD within the tolerances
  deviates      ///< something that was measured does not: another variant, or damage
};
const char* name_of(QualityDecision decision);

/// A length or angle of the part as measured, free of its nominal value.
struct Dimension {
  std::string name;      ///< in words: "cylinder 3: radius", "plane 1 to plane 4: distance"
  std::string kind;      ///< radius | half_angle | distance | angle | coaxiality
  int first = 0;         ///< id of the part's primitive
  int second = 0;        ///< and of the other one; 0 = of one alone
  double nominal = 0;    ///< [mm] or [rad]
  double measured = 0;   ///< the same
  double sigma = 0;      ///< of the measured: noise with its correlation, what patches have in common, systematic terms
  double tolerance = 0;  ///< half width of what passes
  bool is_angle = false;
  bool deviates = false;  ///< off by more than the tolerance and 3 sigma
};

/// A piece of the part's surface that the scan sees elsewhere.
struct Deviation {
  std::string kind;                ///< dent (below the surface), missing (seen through), raised (above it)
  int primitive = 0;               ///< id of the part's primitive that most of it belongs to; 0 = of none
  Vec3 at_part_mm = Vec3::Zero();  ///< its middle, part frame
  double area_mm2 = 0;             ///< of the CAD's surface
  double depth_mm = 0;             ///< mean distance of the scan from the surface, outward positive
  double sigma_mm = 0;             ///< of that mean
};

/// What the scan tells of a found part beyond its pose.
struct Quality {
  QualityDecision decision = QualityDecision::not_checked;
  std::vector<std::string> reasons;   ///< in words: what deviates, or why nothing was checked; empty when nominal
  double checked_fraction = 0;        ///< share of the silhouette that was compared with the CAD, point by point
  std::vector<Dimension> dimensions;  ///< those that the scan tells to within their tolerance
  std::vector<Deviation> deviations;  ///< largest area first
};

}  // namespace tribin
