#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin {

/// Why a candidate was refused: which test of which stage, what was seen, what was wanted.
struct Reason {
  std::string part;                ///< name of the part that was tried
  std::string stage;               ///< hypothesis | verification | selection | refinement | acceptance
  std::string test;                ///< stable key, e.g. free_space, contour, support, residual
  double value = 0;                ///< what was seen
  double limit = 0;                ///< what was wanted
  int count = 1;                   ///< how many candidates fell to this test
  std::optional<Vec3> at_mm = {};  ///< centre of the candidate that came closest to passing, camera frame
  int nearest_instance = 0;        ///< id of the instance that it lies next to; 0 = none was given out
};

/// Counts a refusal: joins it with an equal (part, stage, test), keeping the value that came closest to its limit.
void add_reason(std::vector<Reason>& reasons, const Reason& reason);

}  // namespace tribin
