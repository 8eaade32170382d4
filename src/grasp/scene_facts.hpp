#pragma once

#include <optional>
#include <vector>

#include "depth_space.hpp"
#include "tribin/grasp/grasp.hpp"

// What is worked out once for a scene, before any candidate is looked at.
namespace tribin::grasp {

/// A part as it lies.
struct PartFacts {
  SpanGrid columns;      ///< lowest and highest z of the part over cells of the base's x-y plane
  double top = 0;        ///< highest z [mm]
  double covered = 0;    ///< share of its cells that something lies above
  double height = 1;     ///< rank of its top among those of all parts, [0, 1]
  double entangled = 0;  ///< largest share of another part that lies within this one's hull
  double sigma_mm = 0;   ///< sd of its place in the worst direction, hand-eye included
  Vec3 center = Vec3::Zero();
  double radius_mm = 0;  ///< of a ball about `center` that holds it
};

struct SceneFacts {
  const Scene* scene = nullptr;
  const PlanOptions* options = nullptr;
  std::vector<Convex> bin;
  std::optional<DepthSpace> depth;
  std::vector<PartFacts> parts;  ///< as Scene::parts
};

/// \throws Error bad_option for options out of range.
SceneFacts make_facts(const Scene& scene, const PlanOptions& options);

/// The sd of a point of a part along a unit direction, of its pose and of the hand-eye calibration [mm].
double sigma_along(const Scene& scene, const PartHere& part, const Vec3& base_point, const Vec3& direction);

/// The same of the hand-eye calibration alone, in the worst direction.
double hand_eye_sigma(const Scene& scene, const Vec3& base_point);

}  // namespace tribin::grasp
