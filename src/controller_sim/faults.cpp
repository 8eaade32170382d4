#include "tribin/controller_sim/faults.hpp"

#include <algorithm>
#include <string>

#include "tribin/core/error.hpp"

namespace tribin::controller_sim {
namespace {

constexpr std::string_view kNames[kFaults] = {"delayed_answer",  "split_answer",   "late_lf",
                                              "separate_answer", "drop_before",    "drop_after",
                                              "idle_close",      "close_after",    "ng",
                                              "bracket_error",   "wrong_count",    "blanks",
                                              "odd_version",     "second_refused", "doubled_answer",
                                              "old_answer"};

/// Those that belong to a connection, not to one command.
bool is_of_connection(Fault fault) {
  return fault == Fault::idle_close || fault == Fault::close_after || fault == Fault::odd_version ||
         fault == Fault::second_refused;
}

}  // namespace

std::string_view name_of(Fault fault) { return kNames[static_cast<int>(fault)]; }

Fault fault_from_name(std::string_view name) {
  std::string known;
  for (int i = 0; i < kFaults; ++i) {
    if (name == kNames[i]) return static_cast<Fault>(i);
    known += (known.empty() ? "" : ", ") + std::string(kNames[i]);
  }
  throw Error(ErrorCode::bad_option, "--fault " + std::string(name) + ": wanted one of " + known);
}

bool FaultDice::has(Fault fault) const {
  return std::find(plan_.faults.begin(), plan_.faults.end(), fault) != plan_.faults.end();
}

double FaultDice::uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

std::optional<Fault> FaultDice::throw_dice() {
  if (plan_.faults.empty() || uniform() >= plan_.rate) return std::nullopt;
  const Fault fault = plan_.faults[static_cast<std::size_t>(below(static_cast<int>(plan_.faults.size())))];
  if (is_of_connection(fault)) return std::nullopt;
  return fault;
}

}  // namespace tribin::controller_sim
