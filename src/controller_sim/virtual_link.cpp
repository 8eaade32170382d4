#include "tribin/controller_sim/virtual_link.hpp"

#include <algorithm>
#include <deque>
#include <optional>

namespace tribin::controller_sim {
namespace {

// What a command takes on the way, so that time goes on between commands too.
constexpr double kWay_s = 0.0005;

class VirtualStream : public robot::ByteStream {
 public:
  VirtualStream(Wire& wire, VirtualClock& clock) : wire_(wire), clock_(clock) {}

  void open(double) override {
    pass(0);
    queue_.clear();
    session_.emplace(wire_);
    gone_ = false;
  }
  void close() override { session_.reset(); }

  bool send(std::string_view bytes) override {
    pass(kWay_s);
    if (!session_ || gone_) return false;
    if (session_->idle_over() || session_->closed()) {
      // The other side closed meanwhile: the bytes are lost, and the next receive tells it.
      queue_.push_back({clock_.now_s(), {}, true});
      return true;
    }
    for (Chunk& chunk : session_->receive(bytes)) queue_.push_back(std::move(chunk));
    return true;
  }

  Received receive(double timeout_s) override {
    if (!session_ || gone_) return {{}, true};
    const double until = clock_.now_s() + timeout_s;
    if (queue_.empty() || queue_.front().at_s > until) {
      pass(timeout_s);
      return {};
    }
    pass(std::max(0.0, queue_.front().at_s - clock_.now_s()));
    Received received;
    while (!queue_.empty() && queue_.front().at_s <= clock_.now_s()) {
      received.closed = queue_.front().close;
      received.bytes += queue_.front().bytes;
      queue_.pop_front();
      if (received.closed) break;
    }
    // Bytes that came before the end are read first.
    if (received.closed && !received.bytes.empty()) {
      queue_.push_front({clock_.now_s(), {}, true});
      received.closed = false;
    }
    gone_ = received.closed;
    return received;
  }

 private:
  void pass(double seconds) {
    clock_.sleep_s(seconds);
    wire_.machine.advance(clock_.now_s());
  }

  Wire& wire_;
  VirtualClock& clock_;
  std::optional<Nx100Session> session_;
  std::deque<Chunk> queue_;
  bool gone_ = false;
};

class VirtualDatagrams : public robot::DatagramLink {
 public:
  VirtualDatagrams(Wire& wire, VirtualClock& clock, bool file_port)
      : wire_(wire), clock_(clock), file_port_(file_port) {}

  void send(std::string_view bytes) override {
    clock_.sleep_s(kWay_s);
    wire_.machine.advance(clock_.now_s());
    for (Chunk& chunk : hses_answer(wire_, bytes, file_port_)) queue_.push_back(std::move(chunk));
    // Late ones are overtaken.
    std::stable_sort(queue_.begin(), queue_.end(), [](const Chunk& a, const Chunk& b) { return a.at_s < b.at_s; });
  }

  std::string receive(double timeout_s) override {
    const double now = clock_.now_s();
    const bool comes = !queue_.empty() && queue_.front().at_s <= now + timeout_s;
    clock_.sleep_s(comes ? std::max(0.0, queue_.front().at_s - now) : timeout_s);
    wire_.machine.advance(clock_.now_s());
    if (!comes) return {};
    std::string bytes = std::move(queue_.front().bytes);
    queue_.pop_front();
    return bytes;
  }

 private:
  Wire& wire_;
  VirtualClock& clock_;
  bool file_port_;
  std::deque<Chunk> queue_;
};

}  // namespace

std::unique_ptr<robot::ByteStream> virtual_stream(Wire& wire, VirtualClock& clock) {
  return std::make_unique<VirtualStream>(wire, clock);
}

std::unique_ptr<robot::DatagramLink> virtual_datagrams(Wire& wire, VirtualClock& clock, bool file_port) {
  return std::make_unique<VirtualDatagrams>(wire, clock, file_port);
}

}  // namespace tribin::controller_sim
