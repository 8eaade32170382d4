#pragma once

#include <functional>
#include <memory>
#include <string>

#include "tribin/robot/controller_queue.hpp"
#include "tribin/robot/safety.hpp"

/// Watches a robot while it moves, and puts it on hold when there is a reason.
namespace tribin::robot {

class Watchdog {
 public:
  /// \param queue, clock  must outlive it
  /// \param facts  asked five times a second: what the program knows of client, scan, place of the tool and operator;
  /// now_s
  ///               and status_s are filled in here. Called in the watchdog's thread.
  /// \param told   gets the reason of each hold, and whether the controller took it; in the watchdog's thread
  Watchdog(ControllerQueue& queue, Clock& clock, std::function<WatchFacts()> facts, const WatchLimits& limits,
           std::function<void(const std::string& reason, bool held)> told);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// On: from now on it watches and reads the status every 0.2 s. It switches itself off when it has held the robot.
  void watch(bool on);
  bool watching() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::robot
