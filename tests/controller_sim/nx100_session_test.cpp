// The simulated NX100 takes every style of clients and no garbage; the client survives every fault of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin {
namespace {

using namespace controller_sim;
using robot::Controller;
using robot::ControllerError;
using robot::ControllerFault;

std::string joined(const std::vector<Chunk>& chunks) {
  std::string bytes;
  for (const Chunk& chunk : chunks) bytes += chunk.close ? "<closed>" : chunk.bytes;
  return bytes;
}

struct SessionTest : testing::Test {
  Machine machine;
  Wire wire{machine, {}};
  Nx100Session session{wire};
  std::string say(const std::string& bytes) { return joined(session.receive(bytes)); }
  void start() {
    EXPECT_EQ(say("CONNECT Robot_access Keep-Alive:-1\r\n"), "OK: NX Information Server( 1.16) Keep-Alive:-1.\r\n");
  }
};

TEST_F(SessionTest, SpeaksTheSessionOfThePage) {
  machine.add_job(parse_job(handshake_job(), "BPICK"));
  machine.servo(false);
  start();
  EXPECT_EQ(say("HOSTCTRL_REQUEST RSTATS 0\r\n"), "OK: RSTATS\r\n194,0\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST RPOSC 4\r\n"), "OK: RPOSC\r\n");
  EXPECT_EQ(say("1,0\r"), "600.000,0.000,500.000,180.00,0.00,0.00,1,1\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST MOVL 68\r\n"), "OK: MOVL\r\n");
  EXPECT_EQ(say("0,100.0,1,353.769,202.779,120.658,-1.34,35.78,27.84,1,0,0,0,0,0,0,0\r"),
            "ERROR: MOVL is not successful(2070).\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST SVON 2\r\n1\r"), "OK: SVON\r\n0000\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST LOADV 62\r\n4,10,1,1,812.500,-104.250,233.000,180.0000,0.0000,45.0000,1,1\r"),
            "OK: LOADV\r\n0000\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST SAVEV 5\r\n4,10\r"),
            "OK: SAVEV\r\n1,1,812.500,-104.250,233.000,180.00,0.00,45.00,1,1\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST SAVEV 5\r\n4,99\r"), "OK: SAVEV\r\nERROR: SAVEV is not successful(4130).\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST LOADV 6\r\n0,0,1\r"), "OK: LOADV\r\n0000\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST START 6\r\nBPICK\r"), "OK: START\r\n0000\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST RSTATS 0\r\n"), "OK: RSTATS\r\n202,64\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST HOLD 2\r\n1\r"), "OK: HOLD\r\n0000\r\n");
  EXPECT_EQ(say("HOSTCTRL_REQUEST RSTATS 0\r\n"), "OK: RSTATS\r\n194,72\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST RALARM 0\r\n"), "OK: RALARM\r\n0,0,0,0,0,0,0,0,0,0\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST RJDIR 2\r\n*\r"), "OK: RJDIR\r\nBPICK\r");
  EXPECT_EQ(say("HOSTCTRL_REQUEST FOO 0\r\n"), "NG: FOO\r\n<closed>");
  wire.unknown_is_ng = false;
  Nx100Session other(wire);
  other.receive("CONNECT Robot_access Keep-Alive:-1\r\n");
  EXPECT_EQ(joined(other.receive("HOSTCTRL_REQUEST FOO 0\r\n")), "OK: FOO\r\nERROR: FOO is not successful(1010).\r\n");
}

TEST_F(SessionTest, TakesTheOtherCommandsOfThePage) {
  start();
  const auto command = [this](const std::string& name, const std::string& data) {
    const std::string answer = say(robot::nx100::request(name, data) + (data.empty() ? "" : data + "\r"));
    const std::string ok = "OK: " + name + "\r\n";
    EXPECT_TRUE(answer.starts_with(ok)) << answer;
    return answer.substr(std::min(ok.size(), answer.size()));
  };
  EXPECT_EQ(command("IOWRITE", "22010,8,5"), "0000\r\n");
  EXPECT_EQ(command("IOREAD", "22010,8"), "5\r");
  machine.set_input(2, true);
  EXPECT_EQ(command("IOREAD", "10,24"), "2,0,0\r");
  EXPECT_EQ(command("MDSP", "VISION READY"), "0000\r\n");
  EXPECT_EQ(machine.pendant_text, "VISION READY");
  EXPECT_EQ(command("MDSP", std::string(31, 'x')), "ERROR: MDSP is not successful(1013).\r\n");
  const std::string frame =
      "1,0.000,0.000,0.000,0.00,0.00,0.00,0,100.000,0.000,0.000,0.00,0.00,0.00,0,0.000,100.000,0.000,0.00,0.00,0.00,0,"
      "0,0,"
      "0,0,0,0,0";
  EXPECT_EQ(command("MOVL", "0,100.0,2,1,2,3,0,0,0,1,0,0,0,0,0,0,0"), "ERROR: MOVL is not successful(3350).\r\n");
  EXPECT_EQ(command("WUFRAME", frame), "0000\r\n");
  EXPECT_EQ(command("RUFRAME", "1"), frame.substr(2) + "\r");
  EXPECT_EQ(command("CGROUP", "1,0"), "0000\r\n");
  EXPECT_EQ(command("CTASK", "0"), "0000\r\n");
  EXPECT_EQ(command("CYCLE", "3"), "0000\r\n");
  EXPECT_EQ(command("RSTATS", ""), "196,64\r");
  EXPECT_EQ(command("MODE", "1"), "0000\r\n");
  EXPECT_EQ(command("RSTATS", ""), "164,64\r");
  EXPECT_EQ(command("START", "NONE"), "ERROR: START is not successful(2080).\r\n");
  EXPECT_EQ(command("MODE", "2"), "0000\r\n");
  EXPECT_EQ(command("START", "NONE"), "ERROR: START is not successful(4040).\r\n");
  EXPECT_EQ(command("START", ""), "ERROR: START is not successful(4060).\r\n");
  EXPECT_EQ(command("JWAIT", "10"), "0\r");
  EXPECT_EQ(command("HLOCK", "1"), "0000\r\n");
  EXPECT_EQ(command("PMOVJ", "10.00,0,0,0,0,0,0,0,0,0,0,0,0,0"), "0000\r\n");
  EXPECT_EQ(command("PMOVJ", "10.00,0,0,0,0,0,0,0,0,0,0,0,0,0"), "ERROR: PMOVJ is not successful(2010).\r\n");
  for (double t = 0; t < 5; t += 0.1) machine.advance(t);
  EXPECT_EQ(command("IMOV", "0,50.0,1,0.000,0.000,-25.000,0.00,0.00,0.00,0,0,0,0,0,0,0,0"), "0000\r\n");
  for (double t = 5; t < 10; t += 0.1) machine.advance(t);
  EXPECT_EQ(command("RPOSC", "1,0"), "600.000,0.000,475.000,180.00,0.00,0.00,1,0\r");
  EXPECT_EQ(command("RPOSC", "1,1"), "600.000,0.000,475.000,180.00,0.00,0.00,1,0,0,0,0,0,0,0\r");
  EXPECT_EQ(command("RPOSJ", ""), "0,0,0,0,0,0,0,0,0,0,0,0\r");
  EXPECT_EQ(command("MOVJ", "5.00,1,352.769,202.779,120.658,-1.34,35.78,27.84,1,0"),
            "ERROR: MOVJ is not successful(1011).\r\n");
  EXPECT_EQ(command("MOVJ", "500,1,352.769,202.779,120.658,-1.34,35.78,27.84,1,0,0,0,0,0,0,0"),
            "ERROR: MOVJ is not successful(1012).\r\n");
  EXPECT_EQ(command("MOVJ", "5,1,nan,202.779,120.658,-1.34,35.78,27.84,1,0,0,0,0,0,0,0"),
            "ERROR: MOVJ is not successful(1012).\r\n");
  machine.set_remote(false);
  EXPECT_EQ(command("LOADV", "0,0,1"), "ERROR: LOADV is not successful(2100).\r\n");
  EXPECT_EQ(command("RSTATS", ""), "68,64\r");
}

TEST_F(SessionTest, TakesAllStylesOfLineEnds) {
  struct Style {
    const char* name;
    std::string command_end, data_end;
    int size_of_end;
  };
  const Style styles[] = {{"normal", "\r\n", "\r", 1},
                          {"commands end by CR", "\r", "\r", 1},
                          {"data ends by CR LF, counted to CR", "\r\n", "\r\n", 1},
                          {"data ends by CR LF, both counted", "\r\n", "\r\n", 2},
                          {"data counted without its CR", "\r\n", "\r", 0}};
  // Every style in one session after the other, in segments of every length.
  start();
  for (std::size_t piece : {1u, 2u, 3u, 7u, 1000u})
    for (const Style& style : styles)
      for (const std::string data : {"0,7,42", " 0, +7, 42"}) {
        SCOPED_TRACE(style.name);
        const std::string size = std::to_string(static_cast<int>(data.size()) + style.size_of_end);
        const std::string bytes = "HOSTCTRL_REQUEST LOADV " + size + style.command_end + data + style.data_end +
                                  "HOSTCTRL_REQUEST RSTATS 0" + style.command_end;
        machine.bytes.clear();
        std::string answer;
        for (std::size_t i = 0; i < bytes.size(); i += piece) answer += say(bytes.substr(i, piece));
        EXPECT_EQ(answer, "OK: LOADV\r\n0000\r\nOK: RSTATS\r\n194,64\r");
        EXPECT_EQ(machine.bytes[7], 42);
      }
}

TEST_F(SessionTest, StartRequestsComeInSeveralSpellings) {
  for (const char* text : {"CONNECT Robot_access Keep-Alive:5\r\n", "CONNECT Robot_access KeepAlive:5 \r\n",
                           "CONNECT Robot_access Keep-Alive: 5\r"}) {
    Nx100Session other(wire);
    EXPECT_EQ(joined(other.receive(text)), "OK: NX Information Server( 1.16) Keep-Alive:5.\r\n") << text;
  }
  Nx100Session once(wire);
  EXPECT_EQ(joined(once.receive("CONNECT Robot_access\r\n")), "OK: NX Information Server( 1.16).\r\n");
  EXPECT_EQ(joined(once.receive("HOSTCTRL_REQUEST RSTATS 0\r\n")), "OK: RSTATS\r\n194,64\r<closed>");
  for (const char* text :
       {"GET / HTTP/1.1\r\n", "CONNECT Robot_access Keep-Alive:1\r\n", "CONNECT Robot_access Keep-Alive:x\r\n",
        "CONNECT\r\n", "CONNECT Robot_access Keep-Alive:99999\r\n"}) {
    Nx100Session other(wire);
    EXPECT_EQ(joined(other.receive(text)), "NG: HTTP Error Response\r\n<closed>") << text;
  }
  Nx100Session counted(wire);
  counted.receive("CONNECT Robot_access Keep-Alive:2\r\n");
  EXPECT_EQ(joined(counted.receive("HOSTCTRL_REQUEST RSTATS 0\r\n")), "OK: RSTATS\r\n194,64\r");
  EXPECT_TRUE(joined(counted.receive("HOSTCTRL_REQUEST RSTATS 0\r\n")).ends_with("<closed>"));
}

TEST_F(SessionTest, GarbageEndsTheSessionAndNothingElse) {
  for (const std::string& garbage :
       {std::string("HOSTCTRL_REQUEST LOADV 9999999999\r\n"), std::string("HOSTCTRL_REQUEST LOADV -6\r\n"),
        std::string("HOSTCTRL_REQUEST LOADV 1025\r\n"), std::string("HOSTCTRL_REQUEST LOADV x\r\n"),
        std::string("HOSTCTRL_REQUEST\r\n"), std::string("LOADV 6\r\n"), std::string(10 << 20, 'a'),
        std::string(2000, '\0') + "\r", "HOSTCTRL_REQUEST " + std::string(3000, 'A') + " 0\r\n"}) {
    Nx100Session other(wire);
    other.receive("CONNECT Robot_access Keep-Alive:-1\r\n");
    const std::string answer = joined(other.receive(garbage));
    EXPECT_TRUE(answer.starts_with("NG") && answer.ends_with("<closed>"))
        << garbage.substr(0, 40) << " -> " << answer.substr(0, 60);
    EXPECT_TRUE(other.closed());
    EXPECT_TRUE(other.receive("HOSTCTRL_REQUEST RSTATS 0\r\n").empty());
  }
  start();
  EXPECT_EQ(say(std::string("HOSTCTRL_REQUEST LOADV 6\r\n0,\0,1\r", 32)),
            "OK: LOADV\r\nERROR: LOADV is not successful(1011).\r\n");
  EXPECT_EQ(say("\n\n\r\r\n\rHOSTCTRL_REQUEST RSTATS 0\r\n"), "OK: RSTATS\r\n194,64\r");
}

TEST(BpickJob, IsTheSampleProgram) {
  std::ifstream file(std::string(TRIBIN_SOURCE_DIR) + "/examples/robots/BPICK.JBI", std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  std::string sample = text.str();
  std::erase(sample, '\r');
  EXPECT_EQ(sample, handshake_job());
  EXPECT_EQ(text.str().size() - sample.size(),
            static_cast<std::size_t>(std::count(sample.begin(), sample.end(), '\n')));
}

TEST(BpickJob, OfTwoArmsAreTheSamplePrograms) {
  for (const int arm : {1, 2}) {
    std::ifstream file(std::string(TRIBIN_SOURCE_DIR) + "/examples/robots/BPICK" + std::to_string(arm) + ".JBI",
                       std::ios::binary);
    std::string sample(std::istreambuf_iterator<char>(file), {});
    std::erase(sample, '\r');
    EXPECT_EQ(sample, handshake_job_of_arm(arm));
  }
}

std::unique_ptr<Controller> client_of(const std::string& protocol, Wire& wire, VirtualClock& clock) {
  if (protocol == "nx100") return robot::make_nx100(virtual_stream(wire, clock), clock);
  return robot::make_hses(virtual_datagrams(wire, clock), clock, {}, {}, virtual_datagrams(wire, clock, true));
}

struct BothProtocols : testing::TestWithParam<const char*> {};

TEST_P(BothProtocols, EverythingThatIsWrittenIsReadBack) {
  Machine machine;
  machine.add_job(parse_job(handshake_job(), "BPICK"));
  Wire wire(machine, {});
  VirtualClock clock;
  const auto client = client_of(GetParam(), wire, clock);
  client->write_byte(3, 250);
  client->write_integer(4, -1234);
  client->write_double(5, -100000);
  client->write_real(6, 12.5);
  EXPECT_EQ(client->read_byte(3), 250);
  EXPECT_EQ(client->read_integer(4), -1234);
  EXPECT_EQ(client->read_double(5), -100000);
  EXPECT_EQ(client->read_real(6), 12.5);
  const robot::CartesianPosition p{1, {812.5, -104.25, 233, 180, 0, 45}, 5, 1, 0};
  client->write_position(10, p);
  EXPECT_TRUE(same_position(client->read_position(10), p, client->angle_step_deg()));
  const robot::PulsePosition pulses{{1, -2, 3, -4, 5, -6}, 1};
  client->write_position(11, pulses);
  EXPECT_TRUE(same_position(client->read_position(11), pulses, client->angle_step_deg()));
  EXPECT_THROW(client->read_position(99), ControllerError);
  EXPECT_EQ(client->position().numbers[0], 600);
  EXPECT_GE(client->pulses().pulses.size(), 6u);
  EXPECT_TRUE(client->status().ready());
  client->start_job("BPICK");
  EXPECT_TRUE(client->status().running);
  EXPECT_EQ(client->running_job().name, "BPICK");
  client->hold(true);
  EXPECT_TRUE(client->status().held_by_command);
  EXPECT_THROW(client->start_job(""), ControllerError);
  client->hold(false);
  EXPECT_FALSE(client->status().running);
  client->start_job("");
  EXPECT_TRUE(client->status().running);
  machine.raise_alarm(4107, 2);
  EXPECT_EQ(client->alarms().alarms.at(0).code, 4107);
  EXPECT_FALSE(client->status().running);
  const auto token = robot::OperatorToken::confirm("k", "k");
  client->reset_alarm(token);
  EXPECT_TRUE(client->status().ready());
  client->set_servo(false, token);
  EXPECT_FALSE(client->status().servo_on);
  machine.emergency_stop(true);
  EXPECT_THROW(client->set_servo(true, token), ControllerError);
  client->delete_job("BPICK", token);
  EXPECT_FALSE(machine.has_job("BPICK"));
}

TEST_P(BothProtocols, EveryFaultLeavesTheClientAble) {
  for (int i = 0; i < kFaults; ++i) {
    const Fault fault = static_cast<Fault>(i);
    SCOPED_TRACE(name_of(fault));
    Machine machine;
    FaultPlan plan;
    plan.faults = {fault};
    plan.rate = 0.5;
    plan.seed = 7;
    plan.close_after = 3;
    plan.idle_s = 1;
    Wire wire(machine, plan);
    VirtualClock clock;
    const auto client = client_of(GetParam(), wire, clock);
    int wrong = 0, failed = 0;
    for (int k = 0; k < 100; ++k) {
      clock.sleep_s(k % 10 == 0 ? 2 : 0.01);
      try {
        wrong += client->status().play != true;
        wrong += client->position().numbers[0] != 600;
        wrong += client->read_byte(1) != machine.bytes[1];
        client->write_byte(1, k);
        wrong += machine.bytes[1] != k;  // what is said to be written is written
      } catch (const ControllerError&) {
        ++failed;
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_LT(failed, 85);
  }
}

INSTANTIATE_TEST_SUITE_P(Protocols, BothProtocols, testing::Values("nx100", "hses"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace tribin
