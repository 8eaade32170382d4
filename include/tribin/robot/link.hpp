#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

/// Clocks and links, so that a client runs on a real network, on a faster clock or on no network at all.
namespace tribin::robot {

/// A monotonic clock. Time-outs are seconds of this clock.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual double now_s() = 0;
  virtual void sleep_s(double seconds) = 0;
  virtual double rate() const { return 1; }  ///< seconds of this clock in a second of the world
};

/// The world's clock, or one that runs `rate` times as fast.
std::unique_ptr<Clock> make_clock(double rate = 1);

enum class LinkEvent { opened, sent, received, closed };
/// Takes every byte that goes over a link, with the clock's time.
using ByteSink = std::function<void(LinkEvent, double time_s, std::string_view bytes)>;

/// A connection that keeps the order of its bytes (TCP).
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// \throws Error device
  virtual void open(double timeout_s) = 0;
  virtual void close() = 0;
  /// \return false where the connection is gone
  virtual bool send(std::string_view bytes) = 0;
  struct Received {
    std::string bytes;  ///< empty: time out or closed
    bool closed = false;
  };
  virtual Received receive(double timeout_s) = 0;
};

/// Packets that may be lost, doubled or late (UDP).
class DatagramLink {
 public:
  virtual ~DatagramLink() = default;
  /// \throws Error device
  virtual void send(std::string_view bytes) = 0;
  /// \return empty after the time
  virtual std::string receive(double timeout_s) = 0;
};

/// \param clock  must outlive the link
std::unique_ptr<ByteStream> tcp_stream(const std::string& address, int port, Clock& clock);
std::unique_ptr<DatagramLink> udp_link(const std::string& address, int port, Clock& clock);

}  // namespace tribin::robot
