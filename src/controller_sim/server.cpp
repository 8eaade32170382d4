#include "tribin/controller_sim/server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "tribin/core/error.hpp"

namespace tribin::controller_sim {
namespace {

constexpr int kLongestPoll_ms = 20;            // motion and job go on at least so often
constexpr std::size_t kMostWaiting = 1 << 16;  // bytes for a client that does not read: then it is dropped

class Socket {
 public:
  explicit Socket(int handle = -1) : handle_(handle) {}
  Socket(Socket&& other) noexcept : handle_(std::exchange(other.handle_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Socket() {
    if (handle_ >= 0) ::close(handle_);
  }
  int get() const { return handle_; }

 private:
  int handle_;
};

sockaddr_in address_of(const std::string& address, int port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, address.c_str(), &out.sin_addr) != 1)
    throw Error(ErrorCode::bad_option, "saw the address '" + address + "', wanted an IPv4 address");
  return out;
}

Socket bound(const std::string& address, int port, int kind) {
  const sockaddr_in to = address_of(address, port);
  Socket socket(::socket(AF_INET, kind | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  if (kind == SOCK_STREAM) setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (socket.get() < 0 || ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
      (kind == SOCK_STREAM && ::listen(socket.get(), 4) != 0))
    throw Error(ErrorCode::device,
                address + ":" + std::to_string(port) + ": cannot serve there (" + std::strerror(errno) + ")");
  return socket;
}

int port_of(const Socket& socket) {
  sockaddr_in name{};
  socklen_t size = sizeof name;
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&name), &size);
  return ntohs(name.sin_port);
}

struct Client {
  Client(Socket socket_in, Wire& wire) : socket(std::move(socket_in)), session(wire) {}
  Socket socket;
  Nx100Session session;
  std::deque<Chunk> out;
  bool over = false;
};

/// A packet that waits for its time.
struct Late {
  Chunk chunk;
  sockaddr_in to;
  int socket;
};

}  // namespace

struct Server::State {
  State(Wire& wire_in, robot::Clock& clock_in, const ServerOptions& options_in)
      : wire(wire_in), clock(clock_in), options(options_in) {}

  Wire& wire;
  robot::Clock& clock;
  ServerOptions options;
  Socket listener, files;
  std::list<Client> clients;
  std::deque<Late> late;
  std::mutex mutex;
  std::atomic<bool> stop{false};
  double begin_s = 0;
  std::thread thread;

  void log(robot::LinkEvent event, std::string_view bytes) {
    if (options.sink) options.sink(event, wire.machine.now_s(), bytes);
  }
  void advance() { wire.machine.advance(clock.now_s() - begin_s); }

  void accept_client() {
    Socket socket(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.get() < 0) return;
    const std::size_t most = wire.dice.has(Fault::second_refused) ? 1 : static_cast<std::size_t>(options.most_clients);
    if (clients.size() >= most) return;  // closed at once
    const int on = 1;
    setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    log(robot::LinkEvent::opened, {});
    clients.emplace_back(std::move(socket), wire);
  }

  void read_client(Client& client) {
    char bytes[4096];
    const ssize_t n = ::recv(client.socket.get(), bytes, sizeof bytes, 0);
    if (n <= 0) {
      client.over = n == 0 || (errno != EAGAIN && errno != EINTR);
      return;
    }
    const std::string_view received(bytes, static_cast<std::size_t>(n));
    log(robot::LinkEvent::received, received);
    std::size_t waiting = 0;
    for (Chunk& chunk : client.session.receive(received)) client.out.push_back(std::move(chunk));
    for (const Chunk& chunk : client.out) waiting += chunk.bytes.size();
    client.over = client.over || waiting > kMostWaiting;
  }

  void write_client(Client& client) {
    while (!client.out.empty() && client.out.front().at_s <= wire.machine.now_s()) {
      Chunk& chunk = client.out.front();
      if (!chunk.bytes.empty()) {
        const ssize_t n = ::send(client.socket.get(), chunk.bytes.data(), chunk.bytes.size(), MSG_NOSIGNAL);
        if (n < 0) {
          client.over = errno != EAGAIN && errno != EINTR;
          return;
        }
        log(robot::LinkEvent::sent, std::string_view(chunk.bytes).substr(0, static_cast<std::size_t>(n)));
        chunk.bytes.erase(0, static_cast<std::size_t>(n));
        if (!chunk.bytes.empty()) return;
      }
      client.over = client.over || chunk.close;
      client.out.pop_front();
    }
  }

  void read_packets(const Socket& socket, bool file_port) {
    for (int i = 0; i < 16; ++i) {  // then the rest of the work has its turn
      char bytes[2048];
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t n = ::recvfrom(socket.get(), bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (n < 0) return;
      const std::string_view packet(bytes, static_cast<std::size_t>(n));
      log(robot::LinkEvent::received, packet);
      for (Chunk& chunk : hses_answer(wire, packet, file_port))
        if (late.size() < 1000) late.push_back({std::move(chunk), from, socket.get()});
    }
  }

  void send_packets() {
    for (std::size_t i = late.size(); i-- > 0;) {
      Late item = std::move(late.front());
      late.pop_front();
      if (item.chunk.at_s > wire.machine.now_s()) {
        late.push_back(std::move(item));
        continue;
      }
      log(robot::LinkEvent::sent, item.chunk.bytes);
      ::sendto(item.socket, item.chunk.bytes.data(), item.chunk.bytes.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&item.to), sizeof item.to);
    }
  }

  void serve() {
    while (!stop) {
      std::vector<pollfd> entries{{listener.get(), POLLIN, 0}};
      double wait_s = kLongestPoll_ms / 1000.0;
      {
        const std::lock_guard lock(mutex);
        if (files.get() >= 0) entries.push_back({files.get(), POLLIN, 0});
        for (const Client& client : clients) {
          entries.push_back({client.socket.get(), POLLIN, 0});
          if (!client.out.empty())
            wait_s = std::min(wait_s, (client.out.front().at_s - wire.machine.now_s()) / clock.rate());
        }
        for (const Late& item : late)
          wait_s = std::min(wait_s, (item.chunk.at_s - wire.machine.now_s()) / clock.rate());
      }
      ::poll(entries.data(), entries.size(), static_cast<int>(std::ceil(std::max(wait_s, 0.0) * 1000)));
      const std::lock_guard lock(mutex);
      advance();
      const auto readable = [&entries](int handle) {
        for (const pollfd& entry : entries)
          if (entry.fd == handle) return (entry.revents & (POLLIN | POLLHUP | POLLERR)) != 0;
        return false;
      };
      if (options.protocol == Protocol::hses) {
        read_packets(listener, false);
        read_packets(files, true);
        send_packets();
        continue;
      }
      if (readable(listener.get())) accept_client();
      for (Client& client : clients) {
        if (readable(client.socket.get())) read_client(client);
        write_client(client);
        client.over = client.over || (client.session.idle_over() && client.out.empty());
      }
      if (std::any_of(clients.begin(), clients.end(), [](const Client& client) { return client.over; }))
        log(robot::LinkEvent::closed, {});
      clients.remove_if([](const Client& client) { return client.over; });
    }
  }
};

Server::Server(Wire& wire, robot::Clock& clock, const ServerOptions& options)
    : state_(std::make_unique<State>(wire, clock, options)) {
  const bool udp = options.protocol == Protocol::hses;
  if (options.port < 0 || options.port > (udp ? 65534 : 65535))
    throw Error(ErrorCode::bad_option, "saw port " + std::to_string(options.port) + ", wanted 0 to 65535");
  state_->listener = bound(options.address, options.port, udp ? SOCK_DGRAM : SOCK_STREAM);
  // Files have the next port; where any was asked for, any again if that one is taken.
  if (udp) try {
      state_->files = bound(options.address, port() + 1, SOCK_DGRAM);
    } catch (const Error&) {
      if (options.port != 0) throw;
      state_->files = bound(options.address, 0, SOCK_DGRAM);
    }
  state_->begin_s = clock.now_s() - wire.machine.now_s();
  state_->thread = std::thread([state = state_.get()] { state->serve(); });
}

Server::~Server() {
  state_->stop = true;
  state_->thread.join();
}

int Server::port() const { return port_of(state_->listener); }

void Server::locked(const std::function<void()>& work) {
  const std::lock_guard lock(state_->mutex);
  state_->advance();
  work();
}

}  // namespace tribin::controller_sim
