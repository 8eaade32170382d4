#pragma once

#include <memory>
#include <string>

#include "tribin/controller_sim/sessions.hpp"
#include "tribin/robot/link.hpp"

/// The simulated controller on real sockets.
namespace tribin::controller_sim {

enum class Protocol { nx100, hses };

struct ServerOptions {
  Protocol protocol = Protocol::nx100;
  std::string address = "127.0.0.1";  ///< loopback unless told otherwise
  int port = 0;                       ///< 0 = any that is free; HSES takes files at the next one
  int most_clients = 3;               ///< of host control; a real controller has few sockets
  robot::ByteSink sink{};             ///< takes every byte
};

/// Serves in a thread of its own until it is destroyed.
class Server {
 public:
  /// \param wire, clock  must outlive the server; `locked` keeps others apart from it
  /// \throws Error device where the port is taken
  Server(Wire& wire, robot::Clock& clock, const ServerOptions& options);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  int port() const;
  /// Runs a function on the machine while the server stands still.
  void locked(const std::function<void()>& work);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::controller_sim
