// libFuzzer target of one protocol's parsers, named by TRIBIN_FUZZ_PROTOCOL when it is built: any bytes from the wire
// leave server and client whole. Run as  build/fuzz/tests/fuzz/fuzz_nx100 -max_len=4096 CORPUS
#include <deque>
#include <string>

#include "tribin/controller_sim/inform.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/core/error.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"
#include "tribin/robot/text_protocol.hpp"

namespace {

using namespace tribin;
using namespace tribin::controller_sim;

constexpr std::string_view kProtocol = TRIBIN_FUZZ_PROTOCOL;

/// Answers whatever it is asked with the next of the fuzzer's bytes.
struct FuzzStream : robot::ByteStream {
  FuzzStream(std::string_view bytes_in, VirtualClock& clock_in) : bytes(bytes_in), clock(clock_in) {}
  void open(double) override {}
  void close() override {}
  bool send(std::string_view) override { return true; }
  Received receive(double timeout_s) override {
    if (bytes.empty()) {
      clock.sleep_s(timeout_s);
      return {{}, true};
    }
    const std::string_view piece = bytes.substr(0, 1 + static_cast<unsigned char>(bytes[0]) % 40);
    bytes.remove_prefix(piece.size());
    return {std::string(piece), false};
  }
  std::string_view bytes;
  VirtualClock& clock;
};

struct FuzzDatagrams : robot::DatagramLink {
  FuzzDatagrams(std::string_view bytes_in, VirtualClock& clock_in) : bytes(bytes_in), clock(clock_in) {}
  void send(std::string_view) override {}
  std::string receive(double timeout_s) override {
    clock.sleep_s(timeout_s);
    const std::string_view piece = bytes.substr(0, 84);
    bytes.remove_prefix(piece.size());
    return std::string(piece);
  }
  std::string_view bytes;
  VirtualClock& clock;
};

template <class Call>
void try_it(Call call) {
  try {
    call();
  } catch (const Error& error) {
    if (error.code() == ErrorCode::internal) throw;
  }
}

void ask_everything(robot::Controller& client) {
  try_it([&] { client.status(); });
  try_it([&] { client.position(); });
  try_it([&] { client.pulses(); });
  try_it([&] { client.alarms(); });
  try_it([&] { client.running_job(); });
  try_it([&] { client.read_byte(0); });
  try_it([&] { client.read_integer(0); });
  try_it([&] { client.read_real(0); });
  try_it([&] { client.read_position(0); });
  try_it([&] { client.write_byte(0, 1); });
  try_it([&] { client.start_job("BPICK"); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  VirtualClock clock;
  Machine machine;
  Wire wire(machine, {});
  if (kProtocol == "nx100") {
    Nx100Session session(wire);
    session.receive("CONNECT Robot_access Keep-Alive:-1\r\n");
    session.receive(bytes);
    machine.advance(10);
    const auto client = robot::make_nx100(std::make_unique<FuzzStream>(bytes, clock), clock);
    ask_everything(*client);
  } else if (kProtocol == "hses") {
    hses_answer(wire, bytes);
    hses_answer(wire, bytes, true);
    const auto client = robot::make_hses(std::make_unique<FuzzDatagrams>(bytes, clock), clock);
    ask_everything(*client);
  } else if (kProtocol == "text") {
    robot::TextVision vision;
    vision.scan = [] {
      robot::TextScene scene;
      scene.picks.resize(2);
      scene.picks[0].id = 1;
      scene.picks[0].pick.fill(Pose::Identity());
      return scene;
    };
    robot::TextOptions options;
    options.limits.workspace = robot::Box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
    robot::TextSession session(vision, options, clock);
    session.receive("HELLO,1,kuka\r\nSCAN\r\n");
    session.receive(bytes);
  } else {
    try_it([&] { machine.add_job(parse_job(bytes, "fuzz")); });
    for (const std::string& name : machine.job_names()) machine.start(name);
    machine.advance(1);
  }
  return 0;
}
