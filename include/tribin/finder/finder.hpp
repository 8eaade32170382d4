#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tribin/core/stage_times.hpp"
#include "tribin/part/part.hpp"
#include "tribin/recognition/bin.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin {

struct WorkCell;

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
  int time_limit_ms = 0;        ///< 0 = none
  int work_limit = 0;           ///< Instances::work_done of a run to be repeated; 0 = none
  std::optional<KnownBin> bin;  ///< the bin that the parts lie in
};

/// The bin of a cell, as the scan's camera sees it; a file with [bin] alone that names no place leaves it to be sought.
/// \throws Error as base_from_camera (tribin/config/work_cell.hpp).
KnownBin known_bin(const WorkCell& cell, const Scan& scan);

/// Everything that one look at a scan gave: the instances, and what led to them.
struct Found {
  std::string status;  ///< ok | empty | not_empty_no_object | no_data | time_limit
  Surfels surfels;     ///< refers to the scan
  Primitives primitives;
  PrimitiveModel observation;
  std::optional<BinSighting> bin;  ///< where one was given
  Instances instances;
  std::vector<Warning> warnings;
  StageTimes times;
};

/// The perception chain: scan -> surfels -> primitives -> model -> instances. The scan and the parts must outlive the
/// answer. \throws Error too_little_data | out_of_range (a part that cannot be in this scan: a unit mistaken, mostly).
Found find_parts(const Scan& scan, std::span<const Part> parts, const FinderOptions& options = {});

}  // namespace tribin
