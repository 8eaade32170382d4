#pragma once

#include <span>
#include <string>

#include "tribin/finder/finder.hpp"

namespace tribin {

// The JSON messages of the command line and the service: ordered keys, the same bytes for the same input (but for the
// times). Poses and primitives are given in the input's own frame (Scan::input_from_camera). The schemas are in
// schema/.

struct JsonOptions {
  bool times = true;  ///< false leaves `stages_ms` out: then the same input gives the same bytes
};

/// The result of `tribin locate`.
std::string locate_json(const Scan& scan, const Found& found, const JsonOptions& options = {});

/// The result of `tribin segment`: each primitive with its size, spread and covariance, and how they lie to each other.
/// \param surfels  of a scan or of loose points; those count as one row.
std::string segment_json(const Surfels& surfels, const Primitives& primitives, const PrimitiveModel& model,
                         const StageTimes& times, const std::vector<Warning>& warnings,
                         const JsonOptions& options = {});

/// The result of `tribin part`: what the CAD file gives, its symmetries, and how findable it is.
/// \param file  the CAD file's name, for the reader's sake only.
std::string part_json(const Part& part, const std::string& file, const StageTimes& times,
                      const JsonOptions& options = {});

}  // namespace tribin
