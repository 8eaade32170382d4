#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <optional>
#include <thread>

#include "tribin/core/error.hpp"
#include "tribin/robot/text_protocol.hpp"

namespace tribin::robot {
namespace {

constexpr int kPoll_ms = 100;
// A robot program that says nothing for so long is gone; robots scan every few seconds.
constexpr double kSilence_s = 3600;

bool send_all(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

struct TextServer::State {
  TextVision vision;
  TextOptions options;
  ByteSink sink;
  std::unique_ptr<Clock> clock = make_clock();
  int listener = -1, client = -1;
  std::optional<TextSession> session;
  double heard_s = 0;
  std::atomic<bool> stop{false};
  std::thread thread;

  ~State() {
    drop();
    if (listener >= 0) ::close(listener);
  }

  void log(LinkEvent event, std::string_view bytes) {
    if (sink) sink(event, clock->now_s(), bytes);
  }

  void drop() {
    if (client >= 0) {
      ::close(client);
      log(LinkEvent::closed, {});
    }
    client = -1;
    session.reset();
  }

  void take_client() {
    const int socket = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (socket < 0) return;
    if (client >= 0) {  // two programs must never move the same robot
      send_all(socket, std::to_string(static_cast<int>(TextStatus::busy)) + "\r\n");
      ::close(socket);
      return;
    }
    const int on = 1;
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const timeval most{5, 0};  // a client that reads nothing does not stop the server
    setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    client = socket;
    heard_s = clock->now_s();
    session.emplace(vision, options, *clock);
    log(LinkEvent::opened, {});
  }

  void hear_client() {
    char bytes[1024];
    const ssize_t n = ::recv(client, bytes, sizeof bytes, 0);
    if (n <= 0) return drop();
    heard_s = clock->now_s();
    log(LinkEvent::received, std::string_view(bytes, static_cast<std::size_t>(n)));
    const std::string answer = session->receive(std::string_view(bytes, static_cast<std::size_t>(n)));
    log(LinkEvent::sent, answer);
    if (!send_all(client, answer) || session->over()) drop();
  }

  void serve() {
    while (!stop) {
      pollfd entries[2] = {{listener, POLLIN, 0}, {client, POLLIN, 0}};
      if (::poll(entries, client >= 0 ? 2 : 1, kPoll_ms) < 0) continue;
      // The client first: one that has gone makes room for the next.
      if (client >= 0 && entries[1].revents) hear_client();
      if (client >= 0 && clock->now_s() - heard_s > kSilence_s) drop();
      if (entries[0].revents) take_client();
    }
  }
};

TextServer::TextServer(TextVision vision, TextOptions options, const std::string& address, int port, ByteSink sink)
    : state_(std::make_unique<State>()) {
  CommandFacts listening;
  listening.kind = CommandKind::listen;
  listening.listen_address = address;
  listening.has_key = !options.key.empty();
  require_allowed(listening, options.limits);
  state_->vision = std::move(vision);
  state_->options = std::move(options);
  state_->sink = std::move(sink);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  if (port < 0 || port > 65535 ||
      inet_pton(AF_INET, address == "localhost" ? "127.0.0.1" : address.c_str(), &to.sin_addr) != 1)
    throw Error(ErrorCode::bad_option,
                "saw " + address + ", port " + std::to_string(port) + ", wanted an IPv4 address and 0 to 65535");
  state_->listener = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  setsockopt(state_->listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(state_->listener, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
      ::listen(state_->listener, 4) != 0)
    throw Error(ErrorCode::device,
                address + ":" + std::to_string(port) + ": cannot serve there (" + std::strerror(errno) + ")");
  state_->thread = std::thread([state = state_.get()] { state->serve(); });
}

TextServer::~TextServer() {
  state_->stop = true;
  if (state_->thread.joinable()) state_->thread.join();
}

int TextServer::port() const {
  sockaddr_in name{};
  socklen_t size = sizeof name;
  getsockname(state_->listener, reinterpret_cast<sockaddr*>(&name), &size);
  return ntohs(name.sin_port);
}

}  // namespace tribin::robot
