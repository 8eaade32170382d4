// Every example of the protocol's page, and the client against a script of bytes.
#include "tribin/robot/nx100.hpp"

#include <gtest/gtest.h>

#include <deque>

namespace tribin {
namespace {

using namespace robot;
using namespace robot::nx100;

CartesianPosition at(std::array<double, 6> numbers, int type, int tool, int frame = 1) {
  return {frame, numbers, type, tool, 0};
}

/// "HOSTCTRL_REQUEST name size" as it is sent.
std::string head(const std::string& name, const std::string& data) {
  const std::string line = request(name, data);
  EXPECT_TRUE(line.ends_with("\r\n"));
  return line.substr(0, line.size() - 2);
}

TEST(Nx100Lines, WriteTheExamplesOfThePage) {
  const CartesianPosition there = at({353.769, 202.779, 120.658, -1.34, 35.78, 27.84}, 1, 0);
  const std::string movj = movj_data(5, at({352.769, 202.779, 120.658, -1.34, 35.78, 27.84}, 1, 0));
  EXPECT_EQ(movj, "5.00,1,352.769,202.779,120.658,-1.34,35.78,27.84,1,0,0,0,0,0,0,0");
  EXPECT_EQ(head("MOVJ", movj), "HOSTCTRL_REQUEST MOVJ 65");
  const std::string movl = movl_data(100, there);
  EXPECT_EQ(movl, "0,100.0,1,353.769,202.779,120.658,-1.34,35.78,27.84,1,0,0,0,0,0,0,0");
  EXPECT_EQ(head("MOVL", movl), "HOSTCTRL_REQUEST MOVL 68");
  const std::string imov = imov_data(50, at({0, 0, -25, 0, 0, -0.0}, 1, 0));
  EXPECT_EQ(imov, "0,50.0,1,0.000,0.000,-25.000,0.00,0.00,0.00,0,0,0,0,0,0,0,0");
  EXPECT_EQ(head("IMOV", imov), "HOSTCTRL_REQUEST IMOV 60");
  const std::string pmovj = pmovj_data(10, {});
  EXPECT_EQ(pmovj, "10.00,0,0,0,0,0,0,0,0,0,0,0,0,0");
  EXPECT_EQ(head("PMOVJ", pmovj), "HOSTCTRL_REQUEST PMOVJ 32");
  const std::string frame =
      wuframe_data(1, at({0, 0, 0, 0, 0, 0}, 0, 0), at({100, 0, 0, 0, 0, 0}, 0, 0), at({0, 100, 0, 0, 0, 0}, 0, 0), 0);
  EXPECT_EQ(frame,
            "1,0.000,0.000,0.000,0.00,0.00,0.00,0,100.000,0.000,0.000,0.00,0.00,0.00,0,0.000,100.000,0.000,0.00,0.00,"
            "0.00,0,0,0,0,0,0,0,0");
  EXPECT_EQ(head("WUFRAME", frame), "HOSTCTRL_REQUEST WUFRAME 125");

  EXPECT_EQ(loadv_data(VariableType::byte, 0, 1), "0,0,1");
  EXPECT_EQ(head("LOADV", "0,0,1"), "HOSTCTRL_REQUEST LOADV 6");
  EXPECT_EQ(head("LOADV", loadv_data(VariableType::integer, 5, -120)), "HOSTCTRL_REQUEST LOADV 9");
  EXPECT_EQ(loadv_data(VariableType::integer, 5, -120), "1,5,-120");
  EXPECT_EQ(loadv_data(VariableType::double_integer, 1, 100000), "2,1,100000");
  EXPECT_EQ(head("LOADV", "2,1,100000"), "HOSTCTRL_REQUEST LOADV 11");
  EXPECT_EQ(loadv_data(VariableType::real, 2, 12.5), "3,2,12.5");
  EXPECT_EQ(head("LOADV", "3,2,12.5"), "HOSTCTRL_REQUEST LOADV 9");
  const std::string p10 = loadv_data(10, at({812.5, -104.25, 233, 180, 0, 45}, 1, 1), {4});
  EXPECT_EQ(p10, "4,10,1,1,812.500,-104.250,233.000,180.0000,0.0000,45.0000,1,1");
  EXPECT_EQ(head("LOADV", p10), "HOSTCTRL_REQUEST LOADV 62");
  const std::string p11 = loadv_data(11, PulsePosition{std::vector<long>(7, 0), 0});
  EXPECT_EQ(p11, "4,11,0,0,0,0,0,0,0,0,0");
  EXPECT_EQ(loadv_data(11, PulsePosition{std::vector<long>(6, 0), 0}), "4,11,0,0,0,0,0,0,0,0");
  EXPECT_EQ(head("LOADV", "4,11,0,0,0,0,0,0,0,0"), "HOSTCTRL_REQUEST LOADV 21");
  EXPECT_EQ(savev_data(VariableType::byte, 0), "0,0");
  EXPECT_EQ(head("SAVEV", "0,0"), "HOSTCTRL_REQUEST SAVEV 4");
  EXPECT_EQ(head("SAVEV", savev_data(VariableType::position, 10)), "HOSTCTRL_REQUEST SAVEV 5");
  EXPECT_EQ(head("RSTATS", ""), "HOSTCTRL_REQUEST RSTATS 0");
  EXPECT_EQ(request("RPOSC", "1,0"),
            "\x48\x4f\x53\x54\x43\x54\x52\x4c\x5f\x52\x45\x51\x55\x45\x53\x54\x20\x52\x50\x4f\x53\x43\x20\x34\x0d\x0a");
  EXPECT_EQ(start_request(-1),
            "\x43\x4f\x4e\x4e\x45\x43\x54\x20\x52\x6f\x62\x6f\x74\x5f\x61\x63\x63\x65\x73\x73\x20\x4b\x65\x65\x70\x2d"
            "\x41\x6c\x69\x76\x65\x3a\x2d\x31\x0d\x0a");
  EXPECT_EQ(head("START", "BPICK"), "HOSTCTRL_REQUEST START 6");
  EXPECT_EQ(head("SVON", "1"), "HOSTCTRL_REQUEST SVON 2");
  EXPECT_EQ(head("JSEQ", "BPICK,0"), "HOSTCTRL_REQUEST JSEQ 8");
  EXPECT_EQ(head("DELETE", "OLDJOB"), "HOSTCTRL_REQUEST DELETE 7");
  EXPECT_EQ(head("MDSP", "VISION READY"), "HOSTCTRL_REQUEST MDSP 13");
  EXPECT_EQ(head("IOWRITE", "22010,8,5"), "HOSTCTRL_REQUEST IOWRITE 10");
  EXPECT_EQ(head("IOREAD", "70010,24"), "HOSTCTRL_REQUEST IOREAD 9");
}

TEST(Nx100Lines, ReadTheAnswersOfThePage) {
  for (const char* line :
       {"OK: NX Information Server( 1.16).", "OK: NX Information Server( 1.16) Keep-Alive:-1.",
        "OK: DX Information Server( 1.16).", "OK:YR Information Server(2.0)", "OK: FS Information Server(x)"})
    EXPECT_TRUE(is_start_answer(line)) << line;
  EXPECT_FALSE(is_start_answer("NG: HTTP Error Response"));

  EXPECT_EQ(*ending_of("ERROR: MOVL is not successful(2070).").error, 2070);
  EXPECT_EQ(*ending_of("ERROR:[MOVL] is not successful(2070).").error, 2070);
  EXPECT_EQ(ending_of("0000").data, "0000");
  EXPECT_FALSE(ending_of("0000").error);
  EXPECT_EQ(accepted_command("OK: RALARM"), "RALARM");
  EXPECT_EQ(accepted_command("OK:RALARM"), "RALARM");
  EXPECT_FALSE(accepted_command("0000"));

  const auto idle = status_of("194,0");
  ASSERT_TRUE(idle);
  EXPECT_TRUE(idle->remote && idle->play && idle->one_cycle);
  EXPECT_FALSE(idle->running || idle->servo_on || idle->held() || idle->ready());
  EXPECT_TRUE(status_of("194,64")->ready());
  EXPECT_TRUE(status_of("202,64")->running);
  const auto held = status_of(" 194, 72");
  EXPECT_TRUE(held->held_by_command && held->servo_on && !held->ready());
  for (unsigned first = 0; first < 256; ++first)
    EXPECT_EQ(bytes_from_status(status_from_bytes(first, first & 0x7e))[0], first);
  for (const char* bad : {"", "194", "194,0,0", "256,0", "-1,0", "1.5,0", "a,b", "194,,0", "nan,0", "194 0"})
    EXPECT_FALSE(status_of(bad)) << bad;

  const auto position = position_of("353.769,202.779,120.658,-1.34,35.78,27.84,1,0", 1);
  ASSERT_TRUE(position);
  EXPECT_EQ(position->numbers, (std::array<double, 6>{353.769, 202.779, 120.658, -1.34, 35.78, 27.84}));
  EXPECT_EQ(position->type, 1);
  EXPECT_TRUE(position_of("1,2,3,4,5,6,0,0,0,0,0,0,0,0", 1));  // with external axes
  for (const char* bad : {"1,2,3,4,5,6", "1,2,3,4,5,6,7", "1,2,3,4,5,6,7,8,9", "1,2,3,4,5,6,7,8,9,10,11,12,13"})
    EXPECT_FALSE(position_of(bad, 1)) << bad;

  EXPECT_TRUE(alarms_of("0,0,0,0,0,0,0,0,0,0")->alarms.empty());
  const auto alarms = alarms_of("4100,1,4107,2,4321,0,0,0,0,0");
  EXPECT_EQ(alarms->error.code, 4100);
  ASSERT_EQ(alarms->alarms.size(), 2u);
  EXPECT_EQ(alarms->alarms[0].code, 4107);
  EXPECT_FALSE(alarms_of("0,0,0"));
  const auto job = job_of("POYTA,10,9");
  EXPECT_EQ(job->name, "POYTA");
  EXPECT_EQ(job->line, 10);
  EXPECT_EQ(numbers_of("45411,-59646,-55567,667,-1077,-1260,0,0,0,0,0,0")->size(), 12u);
  EXPECT_EQ(numbers_of(" +1 , -2.5,3 ")->at(1), -2.5);
  const auto p = position_variable_of("1,1,812.500,-104.250,233.000,180.0000,0.0000,45.0000,1,1");
  ASSERT_TRUE(p);
  EXPECT_TRUE(same_position(*p, at({812.5, -104.25, 233, -180, 0, 45}, 1, 1), 1e-4));
  EXPECT_FALSE(same_position(*p, at({812.502, -104.25, 233, 180, 0, 45}, 1, 1), 1e-4));
  EXPECT_EQ(std::get<PulsePosition>(*position_variable_of("0,1,2,3,4,5,6,2")).tool, 2);
  EXPECT_FALSE(position_variable_of("2,1"));
}

TEST(Nx100Lines, RefuseWhatIsNotFinite) {
  EXPECT_THROW(movl_data(100, at({std::nan(""), 0, 0, 0, 0, 0}, 0, 0)), ControllerError);
  EXPECT_THROW(loadv_data(1, at({0, 0, HUGE_VAL, 0, 0, 0}, 0, 0)), ControllerError);
  EXPECT_THROW(loadv_data(VariableType::real, 1, std::nan("")), ControllerError);
}

TEST(Nx100Lines, LineEndsAreTakenInAnySegments) {
  const std::string bytes = "OK: RSTATS\r\n194,0\rOK: X\r\n\r\n0000\r\n";
  for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
    LineReader reader;
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < bytes.size(); i += piece) {
      reader.add(bytes.substr(i, piece));
      while (auto line = reader.next()) lines.push_back(*line);
    }
    EXPECT_EQ(lines, (std::vector<std::string>{"OK: RSTATS", "194,0", "OK: X", "0000"})) << piece;
  }
}

TEST(Nx100Lines, JobNamesAreTheMachines) {
  for (const char* good : {"BPICK", "A", "JOB-1_2", "12345678"}) EXPECT_TRUE(is_job_name(good)) << good;
  for (const char* bad : {"", "bpick", "123456789", "*", "A B", "A,0", "A\r"}) EXPECT_FALSE(is_job_name(bad)) << bad;
}

/// A controller that says what a script says: what is expected, then what is answered.
class ScriptedStream : public ByteStream {
 public:
  struct Line {
    std::string expect, answer;
  };
  explicit ScriptedStream(std::deque<Line> script) : script_(std::move(script)) {}
  void open(double) override {}
  void close() override {}
  bool send(std::string_view bytes) override {
    sent_ += bytes;
    while (!script_.empty() && sent_ == script_.front().expect) {
      incoming_ += script_.front().answer;
      script_.pop_front();
      sent_.clear();
    }
    EXPECT_FALSE(script_.empty() && !sent_.empty()) << sent_;
    return true;
  }
  Received receive(double) override {
    Received received{incoming_.substr(0, 1), incoming_.empty()};
    incoming_.erase(0, 1);
    return received;
  }

 private:
  std::deque<Line> script_;
  std::string sent_, incoming_;
};

struct StillClock : Clock {
  double now_s() override { return now; }
  void sleep_s(double seconds) override { now += seconds; }
  double now = 0;
};

TEST(Nx100Client, SpeaksTheSessionOfThePage) {
  const std::deque<ScriptedStream::Line> script = {
      {"CONNECT Robot_access Keep-Alive:-1\r\n", "OK: NX Information Server( 1.16) Keep-Alive:-1.\r\n"},
      {"HOSTCTRL_REQUEST RSTATS 0\r\n", "OK: RSTATS\r\n194,0\r"},
      {"HOSTCTRL_REQUEST RPOSC 4\r\n", "OK: RPOSC\r\n"},
      {"1,0\r", "353.769,202.779,120.658,-1.34,35.78,27.84,1,0\r"},
      {"HOSTCTRL_REQUEST SVON 2\r\n", "OK: SVON\r\n"},
      {"1\r", "0000\r\n"},
      {"HOSTCTRL_REQUEST LOADV 62\r\n", "OK: LOADV\r\n"},
      {"4,10,1,1,812.500,-104.250,233.000,180.0000,0.0000,45.0000,1,1\r", "0000\r\n"},
      {"HOSTCTRL_REQUEST LOADV 6\r\n", "OK: LOADV\r\n"},
      {"0,0,1\r", "0000\r\n"},
      {"HOSTCTRL_REQUEST START 6\r\n", "OK: START\r\n"},
      {"BPICK\r", "0000\r\n"},
      {"HOSTCTRL_REQUEST RSTATS 0\r\n", "OK: RSTATS\r\n202,64\r"},
      {"HOSTCTRL_REQUEST HOLD 2\r\n", "OK: HOLD\r\n"},
      {"1\r", "0000\r\n"},
      {"HOSTCTRL_REQUEST RSTATS 0\r\n", "OK: RSTATS\r\n194,72\r"},
      {"HOSTCTRL_REQUEST RALARM 0\r\n", "OK: RALARM\r\n0,0,0,0,0,0,0,0,0,0\r"},
      {"HOSTCTRL_REQUEST START 6\r\n", "OK: START\r\n"},
      {"BPICK\r", "ERROR: START is not successful(2050).\r\n"},
  };
  StillClock clock;
  std::string sent, received;
  auto client = make_nx100(std::make_unique<ScriptedStream>(script), clock, {.format = {4}},
                           [&](LinkEvent event, double, std::string_view bytes) {
                             if (event == LinkEvent::sent) sent += bytes;
                             if (event == LinkEvent::received) received += bytes;
                           });
  EXPECT_FALSE(client->status().servo_on);
  EXPECT_EQ(client->position().numbers[5], 27.84);
  client->set_servo(true, OperatorToken::confirm("key", "key"));
  client->write_position(10, at({812.5, -104.25, 233, 180, 0, 45}, 1, 1));
  client->write_byte(0, 1);
  client->start_job("BPICK");
  EXPECT_TRUE(client->status().running);
  client->hold(true);
  EXPECT_TRUE(client->status().held_by_command);
  EXPECT_TRUE(client->alarms().alarms.empty());
  try {
    client->start_job("BPICK");
    FAIL();
  } catch (const ControllerError& error) {
    EXPECT_EQ(error.fault(), ControllerFault::refused);
    EXPECT_EQ(error.number(), 2050);
    EXPECT_NE(std::string(error.what()).find("held by command"), std::string::npos);
  }
  std::string to_send, to_receive;  // every byte is logged, but for the last LF, which nobody waits for
  for (const auto& line : script) to_send += line.expect, to_receive += line.answer;
  EXPECT_EQ(sent, to_send);
  EXPECT_EQ(received + "\n", to_receive);
}

TEST(Nx100Client, RefusesBeforeAnythingIsSent) {
  StillClock clock;
  auto client = make_nx100(std::make_unique<ScriptedStream>(std::deque<ScriptedStream::Line>{}), clock);
  EXPECT_THROW(client->start_job("no such name"), ControllerError);
  EXPECT_THROW(client->write_byte(0, 256), ControllerError);
  EXPECT_THROW(client->write_integer(0, 40000), ControllerError);
  const OperatorToken token = OperatorToken::confirm("key", "key");
  EXPECT_THROW(client->delete_job("*", token), ControllerError);
  EXPECT_THROW(OperatorToken::confirm("other", "key"), Error);
  EXPECT_THROW(OperatorToken::confirm("", ""), Error);
}

}  // namespace
}  // namespace tribin
