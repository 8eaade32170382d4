// The program that is killed: runs the cycle of the fake cell against a controller on a port.
// usage: kill_child PORT nx100|hses JOURNAL BIN_FILE SCALE [--recover]
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "support/fake_cell.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"

int main(int argc, char** argv) try {
  using namespace tribin;
  if (argc < 6) return 2;
  const WorkCell cell = test::fake_work_cell();
  const robot::RobotModel robot = read_robot(cell.robots.front().model);
  const std::string bin_file = argv[4];
  test::FakeVision vision(robot, [&bin_file] {
    std::ifstream file(bin_file);
    std::string text;
    file >> text;
    std::vector<bool> in_bin;
    for (const char c : text) in_bin.push_back(c == '1');
    return in_bin;
  });
  const auto clock = robot::make_clock(std::atof(argv[5]));
  const int port = std::atoi(argv[1]);
  const robot::SafetyLimits limits = test::fake_limits(cell);
  const auto controller = robot::make_guarded(
      std::strcmp(argv[2], "nx100") == 0 ? robot::make_nx100(robot::tcp_stream("127.0.0.1", port, *clock), *clock)
                                         : robot::make_hses(robot::udp_link("127.0.0.1", port, *clock), *clock),
      limits, true);
  picking::Journal journal(argv[3], picking::slots_of(*cell.rack).size());
  picking::RunOptions options;
  options.recover_only = argc > 6;
  const picking::RunEnd end =
      run_picking({&cell, &robot, &vision, controller.get(), clock.get(), &journal, limits}, options);
  std::printf("%s\n", end.status.c_str());
  return end.status == "in_doubt" ? 6 : 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "kill_child: %s\n", error.what());
  return 70;
}
