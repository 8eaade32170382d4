#pragma once

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tribin/controller_sim/inform.hpp"
#include "tribin/robot/controller.hpp"

/// A robot controller without a robot: its state, its variables, its jobs, and motion that takes time.
namespace tribin::controller_sim {

struct MachineOptions {
  double acceleration_mm_s2 = 2000;   ///< of straight moves
  double greatest_speed_mm_s = 1500;  ///< what 100 % of a joint move comes to
  double greatest_turn_deg_s = 180;
  double instruction_s = 0.0005;  ///< what an instruction costs that neither moves nor waits
  /// Whether a pose can be reached; one that cannot is taken and then raises an alarm. None: all can.
  std::function<bool(const Pose&)> reachable{};
  /// Told of every change of an output; the world's answer comes by set_input.
  std::function<void(class Machine&, int output, bool on)> on_output{};
};

/// A move that was carried out, or begun.
struct MoveRecord {
  double time_s = 0;
  char position = 0;  ///< 'C', 'P' of a job; 'H' a move by host command
  int index = 0;      ///< of the position
  int cycle = 0;      ///< of the arm's hand-shake when the job took its command: I001, I011
  int arm = 1;        ///< that moved
};

/// Not safe for several threads: who serves it keeps them apart.
class Machine {
 public:
  explicit Machine(MachineOptions options = {});

  /// Lets time pass until then: motion and jobs go on.
  void advance(double now_s);
  double now_s() const { return now_; }

  void add_job(Job job);
  /// A job for the second arm (///GROUP2): it runs beside the other from now on, whenever that runs. What it says is
  /// told of arm 2. \throws Error bad_input where there is no such job
  void run_beside(const std::string& job);
  bool has_job(const std::string& name) const { return jobs_.count(name) > 0; }
  std::vector<std::string> job_names() const;
  /// Message number, 0 = done.
  int delete_job(const std::string& name);

  robot::ControllerStatus status() const;
  /// Where the arm stands before anything has moved it.
  void place(const robot::CartesianPosition& at, int arm = 1) { tasks_[arm - 1].standing = at; }
  robot::CartesianPosition position(int arm = 1) const;  ///< on the way while it moves
  int arms() const { return tasks_[1].stack.empty() ? 1 : 2; }
  const std::vector<long>& pulses() const { return pulses_; }  ///< the last ones that it was sent to
  robot::RunningJob running_job() const;

  // Commands; each gives a message number, 0 = accepted. The order of checks is that of the protocol's page.
  int start(const std::string& job);
  int select(const std::string& job, int line);
  int hold(bool on);
  int servo(bool on);
  int reset();
  int cancel();
  int mode(bool play);
  int move(const robot::CartesianPosition& to, double speed_mm_s, bool relative = false);
  int move_pulses(const robot::PulsePosition& to);  ///< this machine has no joints: it only takes a moment
  /// What a command that moves would be refused for now; of others only `remote` counts.
  int check_ready(bool for_motion) const;

  // Hooks of a test or of the world around.
  void emergency_stop(bool pressed);
  void raise_alarm(int code, int data = 0, bool cause_stays = false);
  void raise_error(int code);
  void remove_cause() { cause_stays_ = false; }
  void hold_by_pendant(bool on);
  void hold_externally(bool on);
  void set_remote(bool on) { remote_ = on; }
  void set_input(int number, bool on) { inputs_[number] = on; }
  bool output(int number) const;

  std::map<int, int> bytes, integers;
  std::map<int, long> doubles;
  std::map<int, double> reals;
  std::map<int, robot::PositionVariable> positions;
  std::map<int, int> network;              ///< bytes of network inputs, by logical number / 10
  std::map<int, std::string> user_frames;  ///< taught ones: their data as WUFRAME brought it
  int cycle_mode = 2;                      ///< 1 step, 2 one cycle, 3 continuous
  std::string pendant_text;
  std::vector<robot::ControllerAlarm> alarm_list;
  robot::ControllerAlarm error;
  bool input(int number) const;
  /// The last 10,000, oldest first.
  const std::deque<MoveRecord>& moves() const { return moves_; }
  void forget_moves() { moves_.clear(); }

 private:
  struct Motion {
    Pose from, to;
    double start_s = 0, duration_s = 0, length_mm = 0;
    robot::CartesianPosition goal;
  };
  struct Frame {
    std::string job;
    std::size_t at = 0;
  };

  /// What one arm does: the job that runs or was stopped, and its motion.
  struct Task {
    std::vector<Frame> stack;  ///< callers below
    double busy_until = 0;     ///< of a timer or an instruction
    double wait_until = -1;    ///< of WAIT IN#; < 0: it waits for none, or has just begun
    bool moving = false;
    bool interrupted = false;  ///< a move was stopped and goes on when the job does
    Motion motion;
    robot::CartesianPosition standing;  ///< where the arm is when it does not move
  };

  Task& task() { return tasks_[task_]; }
  const Task& task() const { return tasks_[task_]; }
  bool take_next_task(double& due_s);
  int begin_motion(const robot::CartesianPosition& to, double speed_mm_s, double turn_deg_s);
  static Pose pose_at(const Motion& motion, double time_s);
  void stop();
  void step_job();
  void execute(const Instruction& instruction);
  bool holds(const Condition& condition) const;
  double value_of(const Operand& operand) const;
  void set_value(const Operand& target, double value);
  void set_output(int number, bool on);
  void record(MoveRecord move);
  const robot::PositionVariable* find_position(const Instruction& instruction) const;
  const Instruction* current() const;

  MachineOptions options_;
  double now_ = 0;
  bool remote_ = true, play_ = true, servo_ = true, emergency_ = false, cause_stays_ = false;
  bool held_pendant_ = false, held_external_ = false, held_command_ = false;
  bool running_ = false;
  std::map<std::string, Job> jobs_;
  std::array<Task, 2> tasks_;  ///< the master's, and one beside it
  std::size_t task_ = 0;       ///< that is at work; the host's commands are to the master
  bool host_move_ = false;
  std::vector<long> pulses_ = std::vector<long>(12, 0);
  std::map<int, bool> inputs_, outputs_;
  std::deque<MoveRecord> moves_;
};

}  // namespace tribin::controller_sim
