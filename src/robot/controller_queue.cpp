#include "tribin/robot/controller_queue.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <limits>
#include <mutex>
#include <thread>

namespace tribin::robot {
namespace {

class Queue : public ControllerQueue {
 public:
  Queue(std::unique_ptr<Controller> controller, Clock& clock, const QueueOptions& options)
      : inner_(std::move(controller)), clock_(clock), options_(options), owner_([this] { work(); }) {}

  ~Queue() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    owner_.join();
  }

  std::optional<double> heard_s() const override {
    const double heard = heard_s_;
    return heard > kNever ? std::optional(heard) : std::nullopt;
  }

  ControllerStatus status() override {
    return turn([](Controller& c) { return c.status(); });
  }
  CartesianPosition position(int frame, int arm) override {
    return turn([=](Controller& c) { return c.position(frame, arm); });
  }
  PulsePosition pulses() override {
    return turn([](Controller& c) { return c.pulses(); });
  }
  ControllerAlarms alarms() override {
    return turn([](Controller& c) { return c.alarms(); });
  }
  RunningJob running_job() override {
    return turn([](Controller& c) { return c.running_job(); });
  }
  int read_byte(int n) override {
    return turn([=](Controller& c) { return c.read_byte(n); });
  }
  int read_integer(int n) override {
    return turn([=](Controller& c) { return c.read_integer(n); });
  }
  long read_double(int n) override {
    return turn([=](Controller& c) { return c.read_double(n); });
  }
  double read_real(int n) override {
    return turn([=](Controller& c) { return c.read_real(n); });
  }
  PositionVariable read_position(int n) override {
    return turn([=](Controller& c) { return c.read_position(n); });
  }
  void write_byte(int n, int value) override {
    turn([=](Controller& c) { c.write_byte(n, value); });
  }
  void write_integer(int n, int value) override {
    turn([=](Controller& c) { c.write_integer(n, value); });
  }
  void write_double(int n, long value) override {
    turn([=](Controller& c) { c.write_double(n, value); });
  }
  void write_real(int n, double value) override {
    turn([=](Controller& c) { c.write_real(n, value); });
  }
  void write_position(int n, const PositionVariable& value) override {
    turn([=](Controller& c) { c.write_position(n, value); });
  }
  double angle_step_deg() const override { return inner_->angle_step_deg(); }

  void hold(bool on) override {
    turn([=](Controller& c) { c.hold(on); }, on);
  }
  void start_job(const std::string& name) override {
    turn([=](Controller& c) { c.start_job(name); });
  }
  void set_servo(bool on, const OperatorToken& token) override {
    turn([=](Controller& c) { c.set_servo(on, token); });
  }
  void reset_alarm(const OperatorToken& token) override {
    turn([=](Controller& c) { c.reset_alarm(token); });
  }
  void cancel_error(const OperatorToken& token) override {
    turn([=](Controller& c) { c.cancel_error(token); });
  }
  void set_play_mode(bool play, const OperatorToken& token) override {
    turn([=](Controller& c) { c.set_play_mode(play, token); });
  }
  void delete_job(const std::string& name, const OperatorToken& token) override {
    turn([=](Controller& c) { c.delete_job(name, token); });
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::lowest();

  /// Waits for its turn and for the answer, in the caller's thread; what the controller throws is thrown here.
  template <class Call>
  auto turn(Call call, bool first = false) -> decltype(call(std::declval<Controller&>())) {
    std::packaged_task<decltype(call(*inner_))()> task([this, &call] {
      if constexpr (std::is_void_v<decltype(call(*inner_))>) {
        call(*inner_);
        heard_s_ = clock_.now_s();
      } else {
        auto answer = call(*inner_);
        heard_s_ = clock_.now_s();
        return answer;
      }
    });
    auto answer = task.get_future();
    {
      const std::lock_guard lock(mutex_);
      if (first)
        waiting_.emplace_front([&task] { task(); });
      else
        waiting_.emplace_back([&task] { task(); });
    }
    wake_.notify_one();
    return answer.get();
  }

  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      const auto idle = std::chrono::duration<double>(options_.idle_s / clock_.rate());
      const bool called = wake_.wait_for(lock, idle, [this] { return stop_ || !waiting_.empty(); });
      if (called && waiting_.empty()) return;
      std::function<void()> task;
      if (called) {
        task = std::move(waiting_.front());
        waiting_.pop_front();
      }
      lock.unlock();
      if (task)
        task();
      else
        ask_status();
      lock.lock();
    }
  }

  void ask_status() {
    try {
      inner_->status();
      heard_s_ = clock_.now_s();
    } catch (const ControllerError&) {
      // That nothing was heard is what heard_s tells.
    }
  }

  std::unique_ptr<Controller> inner_;
  Clock& clock_;
  QueueOptions options_;
  std::atomic<double> heard_s_{kNever};
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> waiting_;
  bool stop_ = false;
  std::thread owner_;  // last: it starts when all the rest is there
};

}  // namespace

std::unique_ptr<ControllerQueue> make_queue(std::unique_ptr<Controller> controller, Clock& clock,
                                            const QueueOptions& options) {
  return std::make_unique<Queue>(std::move(controller), clock, options);
}

}  // namespace tribin::robot
