#include "tribin/robot/watchdog.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace tribin::robot {
namespace {

constexpr double kPeriod_s = 0.2;

}  // namespace

struct Watchdog::State {
  ControllerQueue& queue;
  Clock& clock;
  std::function<WatchFacts()> facts;
  WatchLimits limits;
  std::function<void(const std::string&, bool)> told;
  std::atomic<bool> on{false}, stop{false};
  std::atomic<double> since_s{0};  ///< silence before it watched does not count
  std::thread thread{};

  void look() {
    try {
      queue.status();
    } catch (const ControllerError&) {
      // How long it has been silent is what counts.
    }
    WatchFacts now = facts();
    now.now_s = clock.now_s();
    now.status_s = std::max(since_s.load(), queue.heard_s().value_or(since_s));
    const std::string reason = hold_reason(now, limits);
    if (reason.empty() || !on) return;
    bool held = true;
    try {
      queue.hold(true);
    } catch (const ControllerError&) {
      held = false;  // it stays on watch: the next round tries again
    }
    if (held) on = false;
    told(reason, held);
  }

  void work() {
    while (!stop) {
      const double begin_s = clock.now_s();
      if (on) look();
      const double left_s = kPeriod_s - (clock.now_s() - begin_s);
      if (left_s > 0) clock.sleep_s(left_s);
    }
  }
};

Watchdog::Watchdog(ControllerQueue& queue, Clock& clock, std::function<WatchFacts()> facts, const WatchLimits& limits,
                   std::function<void(const std::string&, bool)> told)
    : state_(new State{queue, clock, std::move(facts), limits, std::move(told)}) {
  state_->thread = std::thread([state = state_.get()] { state->work(); });
}

Watchdog::~Watchdog() {
  state_->stop = true;
  state_->thread.join();
}

void Watchdog::watch(bool on) {
  state_->since_s = state_->clock.now_s();
  state_->on = on;
}

bool Watchdog::watching() const { return state_->on; }

}  // namespace tribin::robot
