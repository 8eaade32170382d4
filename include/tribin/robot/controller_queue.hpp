#pragma once

#include <memory>
#include <optional>

#include "tribin/robot/controller.hpp"
#include "tribin/robot/link.hpp"

/// One controller for many threads: one of them owns the link, one command is outstanding, and a hold goes before all
/// that waits.
namespace tribin::robot {

struct QueueOptions {
  double idle_s = 5;  ///< after so long without a command the status is asked for: it keeps the link alive
};

class ControllerQueue : public Controller {
 public:
  /// When the controller last answered [s of the clock], for watchdogs; none: not yet.
  virtual std::optional<double> heard_s() const = 0;
};

/// Each call waits for its turn and gives what the controller gave. \param clock  must outlive the queue
std::unique_ptr<ControllerQueue> make_queue(std::unique_ptr<Controller> controller, Clock& clock,
                                            const QueueOptions& options = {});

}  // namespace tribin::robot
