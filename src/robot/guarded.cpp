// The gate as a controller of its own, so that no command gets round it.

#include "tribin/robot/safety.hpp"

namespace tribin::robot {
namespace {

class Guarded : public Controller {
 public:
  Guarded(std::unique_ptr<Controller> inner, const SafetyLimits& limits, bool arm,
          std::function<void(const std::string&)> sink)
      : inner_(std::move(inner)), limits_(limits), arm_(arm), sink_(std::move(sink)) {}

  ~Guarded() override {
    if (!started_) return;
    try {
      inner_->hold(true);  // a program that ends leaves no robot that moves
    } catch (const std::exception& error) {
      if (sink_) sink_(std::string("the robot could not be put on hold: ") + error.what());
    }
  }

  ControllerStatus status() override { return inner_->status(); }
  CartesianPosition position(int frame, int arm) override { return inner_->position(frame, arm); }
  PulsePosition pulses() override { return inner_->pulses(); }
  ControllerAlarms alarms() override { return inner_->alarms(); }
  RunningJob running_job() override { return inner_->running_job(); }
  int read_byte(int n) override { return inner_->read_byte(n); }
  int read_integer(int n) override { return inner_->read_integer(n); }
  long read_double(int n) override { return inner_->read_double(n); }
  double read_real(int n) override { return inner_->read_real(n); }
  PositionVariable read_position(int n) override { return inner_->read_position(n); }
  double angle_step_deg() const override { return inner_->angle_step_deg(); }

  void write_byte(int n, int value) override {
    // A byte may be the command of the job that waits: it starts motion.
    write("B" + std::to_string(n) + " = " + std::to_string(value), [&] {
      require_controller();
      inner_->write_byte(n, value);
      started_ = true;
    });
  }
  void write_integer(int n, int value) override {
    write("I" + std::to_string(n) + " = " + std::to_string(value), [&] { inner_->write_integer(n, value); });
  }
  void write_double(int n, long value) override {
    write("D" + std::to_string(n) + " = " + std::to_string(value), [&] { inner_->write_double(n, value); });
  }
  void write_real(int n, double value) override {
    write("R" + std::to_string(n) + " = " + std::to_string(value), [&] { inner_->write_real(n, value); });
  }
  void write_position(int n, const PositionVariable& value) override {
    write("P" + std::to_string(n), [&] {
      require_position(value);
      inner_->write_position(n, value);
    });
  }

  void hold(bool on) override {
    if (on) return inner_->hold(true);  // never refused
    write("HOLD off", [&] { inner_->hold(false); });
  }
  void start_job(const std::string& name) override {
    write("START " + name, [&] {
      require_controller();
      started_ = true;  // from here on it may run, whatever the answer is
      inner_->start_job(name);
    });
  }

  void set_servo(bool on, const OperatorToken& token) override {
    write(on ? "SVON on" : "SVON off", [&] { inner_->set_servo(on, token); });
  }
  void reset_alarm(const OperatorToken& token) override {
    write("RESET", [&] { inner_->reset_alarm(token); });
  }
  void cancel_error(const OperatorToken& token) override {
    write("CANCEL", [&] { inner_->cancel_error(token); });
  }
  void set_play_mode(bool play, const OperatorToken& token) override {
    write("MODE", [&] { inner_->set_play_mode(play, token); });
  }
  void delete_job(const std::string& name, const OperatorToken& token) override {
    write("DELETE " + name, [&] { inner_->delete_job(name, token); });
  }

 private:
  template <class Send>
  void write(const std::string& what, Send send) {
    if (!arm_) {
      if (sink_) sink_("dry run: kept back " + what);
      throw ControllerError(ControllerFault::not_sent, "dry_run: " + what + " was not sent: --arm was not given");
    }
    if (!limits_.allow_arm)
      throw ControllerError(ControllerFault::not_sent, "arm_not_allowed: the work cell does not say allow_arm = true");
    send();
  }

  static void refuse(const std::vector<Refusal>& reasons, std::initializer_list<RefusalCode> that_count) {
    for (const Refusal& refusal : reasons)
      for (const RefusalCode code : that_count)
        if (refusal.code == code)
          throw ControllerError(ControllerFault::not_sent, std::string(name_of(code)) + ": " + refusal.message);
  }

  void require_controller() {
    CommandFacts facts;
    facts.kind = CommandKind::motion;
    facts.status = inner_->status();
    facts.by_running_job = true;
    refuse(refusals(facts, limits_), {RefusalCode::not_remote, RefusalCode::not_play, RefusalCode::alarm,
                                      RefusalCode::error, RefusalCode::held, RefusalCode::servo_off});
  }

  void require_position(const PositionVariable& value) {
    const auto* position = std::get_if<CartesianPosition>(&value);
    if (!position)
      throw ControllerError(ControllerFault::not_sent,
                            "workspace: a position in pulses cannot be held against the workspace");
    CommandFacts facts;
    facts.kind = CommandKind::motion;
    facts.motion.base_from_tcp = {pose_of(*position)};
    facts.motion.tool = position->tool;
    facts.motion.frame = position->frame;
    refuse(refusals(facts, limits_), {RefusalCode::not_finite, RefusalCode::not_rotation, RefusalCode::workspace,
                                      RefusalCode::forbidden, RefusalCode::tool, RefusalCode::frame});
  }

  std::unique_ptr<Controller> inner_;
  SafetyLimits limits_;
  bool arm_;
  bool started_ = false;
  std::function<void(const std::string&)> sink_;
};

}  // namespace

std::unique_ptr<Controller> make_guarded(std::unique_ptr<Controller> controller, const SafetyLimits& limits, bool arm,
                                         std::function<void(const std::string&)> sink) {
  return std::make_unique<Guarded>(std::move(controller), limits, arm, std::move(sink));
}

}  // namespace tribin::robot
