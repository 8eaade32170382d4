#pragma once

#include <algorithm>
#include <chrono>

namespace tribin {

/// When the search has to end. It is asked before each unit of work (one part sought in one round, one place settled);
/// what is done depends on the number of units alone, so that a run can be repeated by it.
class WorkBudget {
 public:
  /// \param time_limit_ms, work_limit  0 = none.
  WorkBudget(int time_limit_ms, int work_limit)
      : start_(Clock::now()), time_limit_ms_(time_limit_ms), work_limit_(work_limit) {}

  /// May another unit be begun?
  bool take() {
    exhausted_ = exhausted_ || (work_limit_ > 0 && done_ >= work_limit_) ||
                 (time_limit_ms_ > 0 && elapsed_ms() + time_to_finish_ms_ > time_limit_ms_);
    done_ += !exhausted_;
    return !exhausted_;
  }

  /// A place took so long from its rivals to its winner: to finish what is found will take about as long each.
  void found_one(double took_ms) { time_to_finish_ms_ += took_ms; }

  double elapsed_ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }
  bool exhausted() const { return exhausted_; }
  int done() const { return done_; }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_;
  int time_limit_ms_ = 0, work_limit_ = 0;
  double time_to_finish_ms_ = 0;
  int done_ = 0;
  bool exhausted_ = false;
};

}  // namespace tribin
