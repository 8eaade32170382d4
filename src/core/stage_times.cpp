#include "tribin/core/stage_times.hpp"

namespace tribin {

void StageTimes::add(const std::string& stage, double ms) {
  for (auto& [name, sum] : stages_ms) {
    if (name == stage) {
      sum += ms;
      return;
    }
  }
  stages_ms.emplace_back(stage, ms);
}

double StageTimes::of(const std::string& stage) const {
  for (const auto& [name, ms] : stages_ms)
    if (name == stage) return ms;
  return 0;
}

double StageTimes::total() const {
  double sum = 0;
  for (const auto& [name, ms] : stages_ms)
    if (name != "read") sum += ms;
  return sum;
}

}  // namespace tribin
