#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/robot/controller.hpp"

/// Job files (.JBI) and the part of INFORM that hand-shake jobs are written in.
namespace tribin::controller_sim {

enum class Operation {
  nop,
  movj,
  movl,
  imov,
  set,
  inc,
  dec,
  add,
  sub,
  timer,
  jump,
  dout,
  wait_input,
  call,
  ret,
  pause,
  abort_job,
  message,
  label,
  end
};

/// A variable (B, I, D, R by its letter) or a number.
struct Operand {
  char kind = '#';  ///< 'B' 'I' 'D' 'R' or '#', a number
  int index = 0;
  double value = 0;
};

enum class Comparison { equal, not_equal, less, greater, less_equal, greater_equal };

/// What must hold for a jump or a call: two operands, or an input that is on or off.
struct Condition {
  bool input = false;
  int input_number = 0;
  bool on = true;
  Operand left, right;
  Comparison comparison = Comparison::equal;
};

struct Instruction {
  Operation operation = Operation::nop;
  int line = 0;       ///< of the job, 0 = NOP
  char position = 0;  ///< 'C' or 'P' of a move
  int position_index = 0;
  double speed = 0;  ///< percent (movj) or mm/s (movl, imov)
  Operand target, value;
  double seconds = 0;  ///< of a timer; of a wait, < 0 = without end
  int io = 0;
  bool on = false;
  std::string text;  ///< label, job or message
  std::optional<Condition> condition;
};

struct Job {
  std::string name;
  std::map<int, robot::PositionVariable> positions;  ///< C00000, ...
  std::map<int, robot::PositionVariable> taught;     ///< P00001, ... with the values of the file
  std::vector<Instruction> instructions;
  std::map<std::string, std::size_t> labels;
};

/// Reads a job file.
/// \param where  for messages
/// \throws Error bad_input, naming the line, what was seen and what was wanted; instructions that the interpreter does
/// not
///         know are among these.
Job parse_job(std::string_view text, const std::string& where);

/// The hand-shake job BPICK of docs/robot.md: examples/robots/BPICK.JBI as it is.
std::string handshake_job();
/// The jobs of two arms, BPICK1 and BPICK2: they go into bin and rack by the tokens B020 and B021 alone, and the first
/// turns the waist. \param arm  1 or 2
std::string handshake_job_of_arm(int arm);
/// TWAIST, which an integrator writes: I005 is the waist's angle then [0.1 deg].
std::string waist_job();

}  // namespace tribin::controller_sim
