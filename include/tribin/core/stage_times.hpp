#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace tribin {

/// Milliseconds of each stage, in the order in which they ran.
struct StageTimes {
  std::vector<std::pair<std::string, double>> stages_ms;

  void add(const std::string& stage, double ms);
  double of(const std::string& stage) const;  ///< 0 if the stage did not run
  double total() const;                       ///< the sum of all but `read`
};

/// Adds the time from construction to destruction to a stage.
class StageTimer {
 public:
  StageTimer(StageTimes& times, std::string stage)
      : times_(times), stage_(std::move(stage)), start_(std::chrono::steady_clock::now()) {}
  ~StageTimer() {
    times_.add(stage_, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count());
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  StageTimes& times_;
  std::string stage_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace tribin
