#include "judge.hpp"

namespace tribin::grasp {

PushPlan plan_pushes(const Scene& scene, const PlanOptions& options) {
  (void)scene;
  (void)options;
  return {};
}

}  // namespace tribin::grasp
