#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tribin/controller_sim/faults.hpp"
#include "tribin/controller_sim/machine.hpp"

/// The controller's side of both protocols, without sockets: bytes in, bytes out with their times.
namespace tribin::controller_sim {

/// Bytes to be sent at a time of the machine's clock, or the end of the connection.
struct Chunk {
  double at_s = 0;
  std::string bytes;
  bool close = false;
};

/// What all connections share.
struct Wire {
  Wire(Machine& machine_in, FaultPlan plan) : machine(machine_in), dice(std::move(plan)) {}
  Machine& machine;
  FaultDice dice;
  bool unknown_is_ng = true;  ///< an unknown command: NG, or OK and ERROR 1010
  int angle_decimals = 2;     ///< of positions in answers
  int commands = 0;           ///< taken so far
  int arm = 1;                ///< that CGROUP chose
};

/// One connection of host control. Bounded whatever comes: lines and sizes beyond 1 KiB end it.
class Nx100Session {
 public:
  explicit Nx100Session(Wire& wire) : wire_(wire), last_s_(wire.machine.now_s()) {}
  /// Takes what the client sent, at the machine's time; gives what is to be sent, in order of time.
  std::vector<Chunk> receive(std::string_view bytes);
  /// Closed by now for being idle.
  bool idle_over() const;
  bool closed() const { return closed_; }

 private:
  void line(const std::string& text);
  void start(const std::string& text);
  void command(const std::string& name, const std::string& data, bool with_data);
  void send(const std::string& bytes, double delay_s = 0);
  void close();

  Wire& wire_;
  std::vector<Chunk> out_;
  std::string buffer_;
  bool started_ = false, closed_ = false;
  bool skip_lf_ = false;
  int commands_left_ = 1;  ///< < 0 = no limit
  int commands_ = 0;
  std::string pending_;  ///< the command whose data is awaited
  long pending_size_ = 0;
  std::optional<Fault> fault_;  ///< that strikes at the command under way
  double last_s_ = 0, send_at_ = 0;
};

/// The answer of a command of host control.
struct CommandAnswer {
  int error = 0;       ///< message number; 0 = well
  std::string data;    ///< empty = 0000
  double delay_s = 0;  ///< of JWAIT
};
CommandAnswer nx100_answer(Wire& wire, const std::string& command, const std::string& data, std::optional<Fault> fault);
bool is_nx100_command(std::string_view name);

/// Answers to a packet of HSES; empty for what is no packet. \param file_port  whether it came to port 10041
std::vector<Chunk> hses_answer(Wire& wire, std::string_view packet, bool file_port = false);

}  // namespace tribin::controller_sim
