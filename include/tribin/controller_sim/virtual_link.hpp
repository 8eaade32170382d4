#pragma once

#include <memory>

#include "tribin/controller_sim/sessions.hpp"
#include "tribin/robot/link.hpp"

/// Client and simulated controller in one thread, on a clock that only waiting moves: the same run every time, and ten
/// thousand cycles in seconds.
namespace tribin::controller_sim {

class VirtualClock : public robot::Clock {
 public:
  double now_s() override { return now_; }
  void sleep_s(double seconds) override { now_ += seconds > 0 ? seconds : 0; }

 private:
  double now_ = 0;
};

/// Links to the wire's machine. Clock and wire must outlive them.
std::unique_ptr<robot::ByteStream> virtual_stream(Wire& wire, VirtualClock& clock);
std::unique_ptr<robot::DatagramLink> virtual_datagrams(Wire& wire, VirtualClock& clock, bool file_port = false);

}  // namespace tribin::controller_sim
