#pragma once

#include <vector>

#include "part_pixels.hpp"
#include "primitive_fit.hpp"

// The part as measured against the part as drawn: primitives, the dimensions between them, the surface point by point.
namespace tribin {

/// A primitive of the part that the scan shows well enough to be fitted.
struct MeasuredPrimitive {
  Primitive nominal;  ///< camera frame, at the part's pose
  FreeFit fit;
  int scan_primitive = 0;  ///< id in the scan's segmentation; 0 = none
  bool mirrored = false;   ///< most of its points may hold other surfaces' light
};

/// A bore or dish: seen from inside.
inline bool is_hollow(const Primitive& p) { return p.concave && p.type != PrimitiveType::plane; }

/// How far the facets of each of the part's primitives lie off the surface that they stand for [mm].
std::vector<double> facet_errors(const Part& part);

std::vector<MeasuredPrimitive> measure_primitives(const Part& part, std::span<const double> facets,
                                                  const SceneDepth& scene, const SceneFeatures& features,
                                                  const PartPixels& pixels, const Instance& instance);

Evidence evidence_of(const MeasuredPrimitive& measured, const PartPixels& pixels,
                     const SystematicVariances& systematic);

/// Radii and half angles of the primitives, angles, distances and coaxiality between two of them, of those that are
/// told to within their tolerance. What deviates comes first, then what is told best; at most 24 that agree.
std::vector<Dimension> measure_dimensions(std::span<const MeasuredPrimitive> measured,
                                          const SystematicVariances& systematic);

/// Pieces of the surface that the scan sees elsewhere by more than the tolerance of form, the noise and what the pose
/// leaves open. \param checked_fraction  share of the silhouette that could be compared.
/// \source ours (docs/quality.md).
std::vector<Deviation> find_deviations(const Part& part, const SceneDepth& scene, const PartPixels& pixels,
                                       const Instance& instance, double& checked_fraction);

}  // namespace tribin
