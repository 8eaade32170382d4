#pragma once

#include <optional>
#include <vector>

#include "tribin/grasp/grasp.hpp"

// How an arm stands along a path of straight moves.
namespace tribin::grasp {

/// Joint angles at places along a path, the path's own points among them.
struct ArmPath {
  std::vector<robot::Joints> along;             ///< at most `step` apart
  std::vector<std::size_t> at_points;           ///< where in `along` each point of the path is
  robot::Margins margins;                       ///< least on the way
  double limit_term = 0, singularity_term = 0;  ///< of the pick, see robot::Reach
};

struct ArmPathResult {
  std::optional<ArmPath> path;
  Why why = Why::reach;  ///< where there is none
  double value = 0, limit = 0;
};

/// Follows a path in one configuration: that of the best reach at its pick, or of the next best where the arm would
/// have to turn over on the way.
/// \param base_from_tcp  the path's points, in order
/// \param pick           which of them is the tightest place
ArmPathResult follow(const ArmHere& arm, const Pose& flange_from_tcp, const std::vector<Pose>& base_from_tcp,
                     std::size_t pick, const PlanOptions& options);

}  // namespace tribin::grasp
