#pragma once

#include <span>

#include "tribin/model/primitive_model.hpp"
#include "tribin/part/part.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin {

struct BinSighting;

struct RecognitionOptions {
  double tolerance_mm = 0;   ///< > 0: p_within_tolerance tells how likely the place is that good
  double tolerance_rad = 0;  ///< and the rotation
  int time_limit_ms = 0;     ///< > 0: the search ends so early that what is found can be finished by then; 0 = none
  int work_limit = 0;        ///< > 0: it ends after so many units of work (Instances::work_done); 0 = none
  const BinSighting* bin = nullptr;  ///< found: parts are sought in it alone, and it holds none itself
};

/// Finds the parts in a scan: hypotheses from primitives, looked up in the depth image, verified by rendering, chosen
/// jointly, refined, with covariance and evidence; what was refused is told with its reason.
/// \param primitives   the scan's segmentation.
/// \param observation  its model.
/// \param surfels      of the scan; surfels.scan is the measuring source.
/// \source Barajas et al., section IV-B and C give the steps; hypotheses, look-up, verification and refinement are ours
///         (docs/recognition.md).
Instances recognize(const Primitives& primitives, const PrimitiveModel& observation, const Surfels& surfels,
                    std::span<const Part> parts, const RecognitionOptions& options = {});

}  // namespace tribin
