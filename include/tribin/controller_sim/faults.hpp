#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string_view>
#include <vector>

/// What can go wrong on the wire, on demand.
namespace tribin::controller_sim {

enum class Fault {
  delayed_answer,   ///< by up to twice `delay_s`
  split_answer,     ///< after every byte
  late_lf,          ///< the LF of CR LF comes in a later segment
  separate_answer,  ///< the OK line and the answer in two segments, where they are one else
  drop_before,      ///< the connection is gone before the command is taken (UDP: the request is lost)
  drop_after,       ///< the command is taken, then the connection is gone (UDP: the answer is lost)
  idle_close,       ///< closed after `idle_s` without a command
  close_after,      ///< closed after `close_after` commands
  ng,               ///< NG for the command, and closed (UDP: an error answer)
  bracket_error,    ///< ERROR:[Command] in place of ERROR: Command
  wrong_count,      ///< 6, 7, 9 or 13 values of a position (UDP: a packet cut short)
  blanks,           ///< after commas
  odd_version,      ///< unusual text of the start answer
  second_refused,   ///< a second client is refused
  doubled_answer,   ///< UDP only: it comes twice
  old_answer,       ///< UDP only: another one comes again before it
};
inline constexpr int kFaults = 16;
/// "delayed_answer", ...
std::string_view name_of(Fault fault);
/// \throws Error bad_option, naming those that there are.
Fault fault_from_name(std::string_view name);

struct FaultPlan {
  std::vector<Fault> faults;
  double rate = 1;  ///< share of the commands at which one of them strikes
  std::uint64_t seed = 1;
  double delay_s = 2;
  double idle_s = 30;
  int close_after = 5;
};

/// Draws what happens to each command.
class FaultDice {
 public:
  explicit FaultDice(FaultPlan plan) : plan_(std::move(plan)), random_(plan_.seed) {}
  const FaultPlan& plan() const { return plan_; }
  bool has(Fault fault) const;
  std::optional<Fault> throw_dice();
  double uniform();
  int below(int count) { return static_cast<int>(uniform() * count); }

 private:
  FaultPlan plan_;
  std::mt19937_64 random_;
};

}  // namespace tribin::controller_sim
