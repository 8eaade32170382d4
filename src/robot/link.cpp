#include "tribin/robot/link.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "tribin/core/error.hpp"

namespace tribin::robot {
namespace {

class WorldClock : public Clock {
 public:
  explicit WorldClock(double rate) : rate_(rate) {}
  double now_s() override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() * rate_;
  }
  void sleep_s(double seconds) override { std::this_thread::sleep_for(std::chrono::duration<double>(seconds / rate_)); }
  double rate() const override { return rate_; }

 private:
  double rate_;
};

struct Address {
  sockaddr_storage storage{};
  socklen_t length = 0;
};

Address resolve(const std::string& name, int port, int kind) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = kind;
  addrinfo* list = nullptr;
  const int failed = getaddrinfo(name.c_str(), std::to_string(port).c_str(), &hints, &list);
  if (failed || !list) throw Error(ErrorCode::device, "no such address: " + name + " (" + gai_strerror(failed) + ")");
  Address address;
  std::memcpy(&address.storage, list->ai_addr, list->ai_addrlen);
  address.length = list->ai_addrlen;
  freeaddrinfo(list);
  return address;
}

/// Waits for events; the time is that of the clock. \return whether they came
bool wait_for(int socket, short events, double timeout_s, const Clock& clock) {
  pollfd entry{socket, events, 0};
  const int ms = static_cast<int>(std::ceil(std::clamp(timeout_s / clock.rate(), 0.0, 1e6) * 1000));
  return ::poll(&entry, 1, ms) > 0;
}

class TcpStream : public ByteStream {
 public:
  TcpStream(std::string address, int port, Clock& clock) : address_(std::move(address)), port_(port), clock_(clock) {}
  ~TcpStream() override { close(); }

  void open(double timeout_s) override {
    close();
    const Address to = resolve(address_, port_, SOCK_STREAM);
    socket_ = ::socket(to.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket_ < 0) fail("no socket");
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&to.storage), to.length) != 0) {
      if (errno != EINPROGRESS) fail("no connection");
      int error = 0;
      socklen_t size = sizeof error;
      if (!wait_for(socket_, POLLOUT, timeout_s, clock_)) {
        errno = ETIMEDOUT;
        fail("no connection");
      }
      getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
      if (error != 0) {
        errno = error;
        fail("no connection");
      }
    }
    const int on = 1;  // short lines there and back: 0.1 ms instead of 44 ms a command
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }

  void close() override {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }

  bool send(std::string_view bytes) override {
    while (!bytes.empty()) {
      const ssize_t n = socket_ < 0 ? -1 : ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n < 0 && (errno == EAGAIN || errno == EINTR) && socket_ >= 0) {
        // Lines are short: a full buffer means that nobody reads any more.
        if (!wait_for(socket_, POLLOUT, 1.0, clock_)) return false;
        continue;
      }
      if (n <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }

  Received receive(double timeout_s) override {
    if (socket_ < 0) return {{}, true};
    if (!wait_for(socket_, POLLIN, timeout_s, clock_)) return {};
    char bytes[4096];
    const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
    if (n > 0) return {std::string(bytes, static_cast<std::size_t>(n)), false};
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return {};
    return {{}, true};
  }

 private:
  [[noreturn]] void fail(const std::string& what) {
    const std::string why = std::strerror(errno);
    close();
    throw Error(ErrorCode::device, address_ + ":" + std::to_string(port_) + ": " + what + " (" + why + ")");
  }

  std::string address_;
  int port_, socket_ = -1;
  Clock& clock_;
};

class UdpLink : public DatagramLink {
 public:
  UdpLink(const std::string& address, int port, Clock& clock)
      : name_(address + ":" + std::to_string(port)), clock_(clock) {
    const Address to = resolve(address, port, SOCK_DGRAM);
    socket_ = ::socket(to.storage.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    // Connected: packets of other senders do not get here.
    if (socket_ < 0 || ::connect(socket_, reinterpret_cast<const sockaddr*>(&to.storage), to.length) != 0) {
      const std::string why = std::strerror(errno);
      if (socket_ >= 0) ::close(socket_);
      throw Error(ErrorCode::device, name_ + ": no socket (" + why + ")");
    }
  }
  ~UdpLink() override { ::close(socket_); }

  void send(std::string_view bytes) override {
    // A refusal of an earlier packet (nobody listens) is not this one's fault: that the answer does not come tells it.
    if (::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) < 0 && errno != ECONNREFUSED && errno != EAGAIN)
      throw Error(ErrorCode::device, name_ + ": cannot send (" + std::strerror(errno) + ")");
  }

  std::string receive(double timeout_s) override {
    if (!wait_for(socket_, POLLIN, timeout_s, clock_)) return {};
    char bytes[2048];
    const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
    if (n > 0) return std::string(bytes, static_cast<std::size_t>(n));
    if (n < 0 && errno == ECONNREFUSED) clock_.sleep_s(timeout_s);  // nobody there: no busy loop of attempts
    return {};
  }

 private:
  std::string name_;
  int socket_ = -1;
  Clock& clock_;
};

}  // namespace

std::unique_ptr<Clock> make_clock(double rate) { return std::make_unique<WorldClock>(rate); }

std::unique_ptr<ByteStream> tcp_stream(const std::string& address, int port, Clock& clock) {
  return std::make_unique<TcpStream>(address, port, clock);
}

std::unique_ptr<DatagramLink> udp_link(const std::string& address, int port, Clock& clock) {
  return std::make_unique<UdpLink>(address, port, clock);
}

}  // namespace tribin::robot
