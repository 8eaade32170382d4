#pragma once

#include <span>
#include <string>
#include <vector>

#include "tribin/core/stage_times.hpp"
#include "tribin/part/part.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin {

struct Warning {
  std::string code;
  std::string text;
};

/// How parts are recognised from the primitives: ours (recognition), or as in sections IV-B and C (paper_method).
enum class Method : std::uint8_t { surfel, paper };

struct FinderOptions {
  Method method = Method::surfel;
  SurfelOptions surfel;
  SegmentationOptions segmentation;
  double tolerance_mm = 0;  ///< 0 = none asked for
  double tolerance_rad = 0;
  int time_limit_ms = 0;  ///< 0 = none
};

/// Everything that one look at a scan gave: the instances, and what led to them.
struct Found {
  std::string status;  ///< ok | empty | not_empty_no_object | no_data | time_limit
  Surfels surfels;     ///< refers to the scan
  Primitives primitives;
  PrimitiveModel observation;
  Instances instances;
  std::vector<Warning> warnings;
  StageTimes times;
};

/// The perception chain: scan -> surfels -> primitives -> model -> instances. The scan and the parts must outlive the
/// answer. \throws Error too_little_data | out_of_range (a part that cannot be in this scan: a unit mistaken, mostly).
Found find_parts(const Scan& scan, std::span<const Part> parts, const FinderOptions& options = {});

}  // namespace tribin
