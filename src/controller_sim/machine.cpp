#include "tribin/controller_sim/machine.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin::controller_sim {

using robot::CartesianPosition;

namespace {

// What the alarm of an unreachable pose is called here; the makers' numbers differ by controller.
constexpr int kUnreachable = 4414;
constexpr int kEmergencyStop = 4000;
constexpr std::size_t kAlarmsKept = 4;  // as many as RALARM shows
// Frames beyond base and robot are user frames.
constexpr int kFirstUserFrame = 2;

}  // namespace

Machine::Machine(MachineOptions options) : options_(std::move(options)) {
  for (Task& task : tasks_) {
    task.standing.numbers = {600, 0, 500, 180, 0, 0};
    task.standing.type = 1;
    task.standing.tool = 1;
  }
}

void Machine::run_beside(const std::string& job) {
  if (!has_job(job)) throw Error(ErrorCode::bad_input, "saw no job " + job + ", wanted one for the second arm");
  tasks_[1].stack.assign(1, {job, 0});
  tasks_[1].busy_until = now_;
}

void Machine::add_job(Job job) {
  for (const auto& [index, position] : job.taught) positions[index] = position;
  const std::string name = job.name;
  jobs_.insert_or_assign(name, std::move(job));
}

std::vector<std::string> Machine::job_names() const {
  std::vector<std::string> names;
  for (const auto& [name, job] : jobs_) names.push_back(name);
  return names;
}

int Machine::delete_job(const std::string& name) {
  if (!remote_) return 2100;
  if (!has_job(name)) return 4040;
  for (const Task& task : tasks_)
    for (const Frame& frame : task.stack)
      if (frame.job == name && running_) return 2010;
  jobs_.erase(name);
  for (Task& task : tasks_) std::erase_if(task.stack, [&name](const Frame& frame) { return frame.job == name; });
  return 0;
}

robot::ControllerStatus Machine::status() const {
  robot::ControllerStatus s;
  s.step = cycle_mode == 1, s.one_cycle = cycle_mode == 2, s.continuous = cycle_mode == 3;
  s.running = running_;
  s.teach = !play_, s.play = play_, s.remote = remote_;
  s.held_by_pendant = held_pendant_, s.held_externally = held_external_, s.held_by_command = held_command_;
  s.alarm = !alarm_list.empty(), s.error = error.code != 0;
  s.servo_on = servo_;
  return s;
}

Pose Machine::pose_at(const Motion& motion, double time_s) {
  const double u = std::clamp((time_s - motion.start_s) / std::max(motion.duration_s, 1e-9), 0.0, 1.0);
  // A trapezoid of speed: a quarter of the time each to start and to stop.
  constexpr double kRamp = 0.25, kTop = 1 / (1 - kRamp);
  const double path = u < kRamp       ? kTop * u * u / (2 * kRamp)
                      : u > 1 - kRamp ? 1 - kTop * (1 - u) * (1 - u) / (2 * kRamp)
                                      : kTop * (u - kRamp / 2);
  Pose pose = Pose::Identity();
  pose.translation() = (1 - path) * motion.from.translation() + path * motion.to.translation();
  const Vec3 turn = vector_from_rotation(motion.to.linear() * motion.from.linear().transpose());
  pose.linear() = rotation_from_vector(path * turn) * motion.from.linear();
  return pose;
}

CartesianPosition Machine::position(int arm) const {
  const Task& of = tasks_[static_cast<std::size_t>(arm) - 1];
  if (!of.moving) return of.standing;
  const CartesianPosition& goal = of.motion.goal;
  return robot::position_from_pose(pose_at(of.motion, now_), goal.type, goal.tool, goal.frame);
}

const Instruction* Machine::current() const {
  if (task().stack.empty()) return nullptr;
  const Frame& frame = task().stack.back();
  const auto job = jobs_.find(frame.job);
  if (job == jobs_.end() || frame.at >= job->second.instructions.size()) return nullptr;
  return &job->second.instructions[frame.at];
}

robot::RunningJob Machine::running_job() const {
  const Instruction* instruction = current();
  if (task().stack.empty()) return {};
  return {task().stack.back().job, instruction ? instruction->line : 0, 0};
}

int Machine::check_ready(bool for_motion) const {
  if (!remote_) return 2100;
  if (!for_motion) return 0;
  if (!play_) return 2080;
  if (!alarm_list.empty() || error.code != 0) return 2060;
  if (held_pendant_) return 2020;
  if (held_external_) return 2040;
  if (held_command_) return 2050;
  if (!servo_) return 2070;
  return running_ ? 2010 : 0;
}

int Machine::start(const std::string& job) {
  if (const int refused = check_ready(true)) return refused;
  if (job.empty()) {
    if (!current()) return 4060;
    running_ = true;
    task().busy_until = now_;
    return 0;
  }
  if (!has_job(job)) return 4040;
  task().stack.assign(1, {job, 0});
  task().interrupted = false;
  task().busy_until = now_;
  task().wait_until = -1;
  running_ = true;
  return 0;
}

int Machine::select(const std::string& job, int line) {
  if (const int refused = check_ready(false)) return refused;
  if (running_) return 2010;
  if (!has_job(job)) return 4040;
  if (line < 0 || line >= static_cast<int>(jobs_.at(job).instructions.size())) return 1012;
  task().stack.assign(1, {job, static_cast<std::size_t>(line)});
  task().interrupted = false;
  task().wait_until = -1;
  return 0;
}

/// What moves stands still where it is; a job that goes on later begins with the instruction that was stopped.
void Machine::stop() {
  for (int arm = 1; arm <= 2; ++arm) {
    Task& stopped = tasks_[static_cast<std::size_t>(arm) - 1];
    if (!stopped.moving) continue;
    stopped.standing = position(arm);
    stopped.moving = false;
    stopped.interrupted = !host_move_;
  }
  host_move_ = running_ = false;
}

int Machine::hold(bool on) {
  if (!remote_) return 2100;
  held_command_ = on;
  if (on) stop();
  return 0;
}

void Machine::hold_by_pendant(bool on) {
  held_pendant_ = on;
  if (on) stop();
}

void Machine::hold_externally(bool on) {
  held_external_ = on;
  if (on) stop();
}

int Machine::servo(bool on) {
  if (!remote_) return 2100;
  if (on && emergency_) return 3450;
  if (!on) stop();
  servo_ = on;
  return 0;
}

int Machine::reset() {
  if (!remote_) return 2100;
  if (!emergency_ && !cause_stays_) alarm_list.clear();
  return 0;
}

int Machine::cancel() {
  if (!remote_) return 2100;
  error = {};
  return 0;
}

int Machine::mode(bool play) {
  if (!remote_) return 2100;
  if (running_) return 2010;
  play_ = play;
  return 0;
}

void Machine::emergency_stop(bool pressed) {
  emergency_ = pressed;
  if (!pressed) return;
  stop();
  servo_ = false;
  raise_alarm(kEmergencyStop);
}

void Machine::raise_alarm(int code, int data, bool cause_stays) {
  stop();
  alarm_list.insert(alarm_list.begin(), {code, data});
  if (alarm_list.size() > kAlarmsKept) alarm_list.pop_back();
  cause_stays_ = cause_stays;
}

void Machine::raise_error(int code) {
  stop();
  error = {code, 0};
}

bool Machine::input(int number) const {
  const auto at = inputs_.find(number);
  return at != inputs_.end() && at->second;
}

bool Machine::output(int number) const {
  const auto at = outputs_.find(number);
  return at != outputs_.end() && at->second;
}

void Machine::set_output(int number, bool on) {
  outputs_[number] = on;
  if (options_.on_output) options_.on_output(*this, number, on);
}

void Machine::record(MoveRecord move) {
  constexpr std::size_t kKept = 10000;
  moves_.push_back(move);
  if (moves_.size() > kKept) moves_.pop_front();
}

int Machine::move(const CartesianPosition& to, double speed_mm_s, bool relative) {
  if (const int refused = check_ready(true)) return refused;
  if (to.frame >= kFirstUserFrame && !user_frames.count(to.frame - kFirstUserFrame + 1)) return 3350;
  CartesianPosition goal = to;
  if (relative) {
    Pose pose = pose_of(task().standing);
    pose.translation() += pose_of(to).translation();
    pose.linear() = pose_of(to).linear() * pose.linear();
    goal = robot::position_from_pose(pose, task().standing.type, to.tool, to.frame);
  }
  record({now_, 'H', 0, integers[1]});
  running_ = host_move_ = true;
  // Taken either way; a pose out of reach raises its alarm afterwards, as the interpreter does when it plans.
  begin_motion(goal, speed_mm_s, options_.greatest_turn_deg_s);
  return 0;
}

int Machine::move_pulses(const robot::PulsePosition& to) {
  if (const int refused = check_ready(true)) return refused;
  pulses_ = to.pulses;
  return move(task().standing, options_.greatest_speed_mm_s);
}

int Machine::begin_motion(const CartesianPosition& to, double speed_mm_s, double turn_deg_s) {
  task().motion.goal = to;
  task().motion.from = pose_of(task().standing);
  task().motion.to = pose_of(to);
  if (options_.reachable && !options_.reachable(task().motion.to)) {
    raise_alarm(kUnreachable);
    return kUnreachable;
  }
  task().motion.length_mm = (task().motion.to.translation() - task().motion.from.translation()).norm();
  const double turn_deg = rotation_angle(task().motion.from.linear(), task().motion.to.linear()) / kDegree;
  const double speed = std::min(speed_mm_s, options_.greatest_speed_mm_s), a = options_.acceleration_mm_s2;
  const double straight = task().motion.length_mm > speed * speed / a ? task().motion.length_mm / speed + speed / a
                                                                      : 2 * std::sqrt(task().motion.length_mm / a);
  task().motion.start_s = now_;
  task().motion.duration_s = std::max(straight, turn_deg / turn_deg_s);
  task().moving = true;
  return 0;
}

/// The task whose move, timer or instruction ends first.
bool Machine::take_next_task(double& due_s) {
  bool found = false;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const Task& of = tasks_[i];
    if (i > 0 && of.stack.empty()) continue;
    const double due = std::max(now_, of.moving ? of.motion.start_s + of.motion.duration_s : of.busy_until);
    if (found && due >= due_s) continue;
    due_s = due, task_ = i, found = true;
  }
  return found;
}

void Machine::advance(double until_s) {
  // Each round ends a move, a timer or an instruction that costs time: the loop always comes to its end.
  while (now_ < until_s) {
    double due = until_s;
    if (!running_ || !take_next_task(due) || due > until_s) {
      now_ = until_s;
      break;
    }
    now_ = due;
    Task& at_work = task();
    if (at_work.moving) {
      at_work.standing = at_work.motion.goal;
      at_work.moving = false;
      if (host_move_ && task_ == 0) {
        host_move_ = running_ = false;
      } else if (!at_work.stack.empty()) {
        ++at_work.stack.back().at;
      }
    } else if (now_ < until_s) {
      step_job();
    }
  }
  task_ = 0;
}

}  // namespace tribin::controller_sim
