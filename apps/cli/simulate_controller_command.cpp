#include <cstdio>
#include <fstream>
#include <iostream>
#include <mutex>
#include <sstream>
#include <thread>

#include "commands.hpp"
#include "tribin/config/robot_file.hpp"
#include "tribin/controller_sim/server.hpp"
#include "tribin/core/error.hpp"
#include "tribin/kinematics/inverse.hpp"

namespace tribin::cli {
namespace {

using namespace controller_sim;

struct Options {
  std::string protocol, address = "127.0.0.1", log, robot, arm = "R1";
  int port = -1;
  std::vector<std::string> faults, jobs;
  double rate = 1, scale = 1, seconds = 0;
  std::uint64_t seed = 1;
  bool start = false, dx = false;
};

Job read_job(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorCode::bad_input, path + ": cannot be read");
  std::stringstream text;
  text << file.rdbuf();
  return parse_job(text.str(), path);
}

/// Every byte with its time, one line a segment: -> from the client, <- to it.
robot::ByteSink sink_into(std::ostream& out) {
  return [&out](robot::LinkEvent event, double time_s, std::string_view bytes) {
    constexpr const char* kNames[] = {"opened", "<-", "->", "closed"};
    char head[48];
    std::snprintf(head, sizeof head, "%10.4f %s ", time_s, kNames[static_cast<int>(event)]);
    out << head;
    for (const char byte : bytes) {
      const auto code = static_cast<unsigned char>(byte);
      if (code >= 32 && code < 127 && byte != '\\') {
        out << byte;
      } else {
        char hex[8];
        std::snprintf(hex, sizeof hex, "\\x%02x", code);
        out << hex;
      }
    }
    out << std::endl;  // at once: the log is for looking at while it runs
  };
}

/// Poses that an arm reaches inside its limits, the tool taken as the flange and the waist at 0.
std::function<bool(const Pose&)> reach_of(const Options& options) {
  const robot::RobotModel model = read_robot(options.robot);
  const robot::Arm arm = arm_called(model, options.arm);
  const Pose arm_from_base = base_from_arm(model, arm).inverse();
  return [arm, arm_from_base](const Pose& pose) { return reach(arm, arm_from_base * pose).has_value(); };
}

int run(const Options& options, const Context&) {
  if (options.protocol != "nx100" && options.protocol != "hses")
    throw Error(ErrorCode::bad_option, options.protocol + ": wanted nx100 or hses");
  FaultPlan plan;
  for (const std::string& fault : options.faults) plan.faults.push_back(fault_from_name(fault));
  plan.rate = options.rate;
  plan.seed = options.seed;

  MachineOptions behaviour;
  // A gripper that always grips: input 1 follows output 1.
  behaviour.on_output = [](Machine& machine, int output, bool on) {
    if (output == 1) machine.set_input(1, on);
  };
  if (!options.robot.empty()) behaviour.reachable = reach_of(options);
  Machine machine(behaviour);
  machine.add_job(parse_job(handshake_job(), "BPICK"));
  for (const std::string& job : options.jobs) machine.add_job(read_job(job));
  if (options.start) machine.start("BPICK");

  Wire wire(machine, plan);
  if (options.dx) wire.angle_decimals = 4;
  const std::unique_ptr<robot::Clock> clock = robot::make_clock(options.scale);
  ServerOptions server_options;
  server_options.protocol = options.protocol == "nx100" ? Protocol::nx100 : Protocol::hses;
  server_options.address = options.address;
  server_options.port = options.port >= 0 ? options.port : server_options.protocol == Protocol::nx100 ? 8080 : 10040;
  std::ofstream log;
  if (!options.log.empty() && options.log != "-") {
    log.open(options.log);
    if (!log) throw Error(ErrorCode::bad_option, "--log " + options.log + ": cannot be written");
  }
  if (!options.log.empty()) server_options.sink = sink_into(options.log == "-" ? std::cout : log);
  const Server server(wire, *clock, server_options);
  std::printf("%s: a simulated controller at %s, port %d; Ctrl-C ends it\n", options.protocol.c_str(),
              options.address.c_str(), server.port());
  std::fflush(stdout);
  const double until = clock->now_s() + options.seconds * options.scale;
  while (options.seconds == 0 || clock->now_s() < until) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return 0;
}

}  // namespace

void add_simulate_controller(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "simulate-controller", "Stand in for a robot controller on the wire",
                                  "tribin simulate-controller nx100 --port 8080 --start");
  command->add_option("protocol", options->protocol, "nx100 (host control, TCP) or hses (UDP)")
      ->required()
      ->type_name("nx100|hses");
  command
      ->add_option("--port", options->port, "0 = any free one; default 8080 (nx100), 10040 (hses, files at the next)")
      ->check(CLI::Range(0, 65535))
      ->type_name("N");
  command->add_option("--address", options->address, "Where to listen; only this machine unless given")
      ->type_name("IP");
  command->add_option("--job", options->jobs, "Job files beside the hand-shake job BPICK")
      ->type_name("JBI")
      ->allow_extra_args(false);
  command->add_option("--robot", options->robot, "Poses out of its reach raise an alarm; without it all are reached")
      ->type_name("TOML");
  command->add_option("--arm", options->arm, "Of the robot")->type_name("NAME");
  command->add_flag("--start", options->start, "BPICK runs from the beginning");
  command->add_flag("--four-decimals", options->dx, "Angles with four decimals, as DX100 and later");
  command
      ->add_option("--fault", options->faults,
                   "What goes wrong: delayed_answer, split_answer, late_lf, ... (docs/robot.md)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command->add_option("--fault-rate", options->rate, "Share of the commands at which one of the faults strikes")
      ->check(CLI::Range(0.0, 1.0))
      ->type_name("X");
  command->add_option("--seed", options->seed, "Of the faults")->type_name("S");
  command->add_option("--time-scale", options->scale, "Seconds of the controller in one of the world")
      ->check(CLI::Range(0.01, 1000.0))
      ->type_name("X");
  command->add_option("--seconds", options->seconds, "End after that time; 0 = never")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("S");
  command->add_option("--log", options->log, "Every byte with its time into a file, or - for stdout")
      ->type_name("FILE");
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
