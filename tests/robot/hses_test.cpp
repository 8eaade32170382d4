// The vectors of the protocol's page, byte for byte.
#include "tribin/robot/hses.hpp"

#include <gtest/gtest.h>

#include <deque>

namespace tribin {
namespace {

using namespace robot;
using namespace robot::hses;

/// "59 45 39x8 + 8 x 00" as bytes.
std::string bytes(const std::string& text) {
  std::string out;
  std::size_t i = 0;
  while (i < text.size()) {
    if (text[i] == ' ') {
      ++i;
      continue;
    }
    const std::string word = text.substr(i, text.find(' ', i) - i);
    i += word.size();
    const std::size_t times = word.find('x');
    const int count = times == std::string::npos ? 1 : std::stoi(word.substr(times + 1));
    out.append(static_cast<std::size_t>(count), static_cast<char>(std::stoi(word.substr(0, times), nullptr, 16)));
  }
  return out;
}

std::string word(int value) {
  std::string data;
  put32(data, value);
  return data;
}

struct Vector {
  const char* name;
  Request request;
  std::string wanted;
};

CartesianPosition p010() { return {1, {812.5, -104.25, 233, 180, 0, 45}, 1, 1, 0}; }

TEST(HsesPackets, AreTheVectorsOfThePage) {
  const auto robot = Division::robot;
  std::vector<Vector> vectors;
  const auto add = [&vectors](const char* name, Division division, std::uint8_t id, std::uint16_t command,
                              std::uint16_t instance, std::uint8_t attribute, Service service, std::string data,
                              std::string wanted) {
    vectors.push_back(
        {name, {division, id, 0, false, command, instance, attribute, service, std::move(data)}, std::move(wanted)});
  };

  add("status", robot, 1, 0x72, 1, 0, Service::get_all, "",
      "59 45 52 43 20 00 00 00 03 01 00 01 00 00 00 00 39x8 72 00 01 00 00 01 00 00");
  add("servo on", robot, 2, 0x83, 2, 1, Service::set_one, word(1),
      "59 45 52 43 20 00 04 00 03 01 00 02 00 00 00 00 39x8 83 00 02 00 01 10 00 00 01 00 00 00");
  add("hold on", robot, 3, 0x83, 1, 1, Service::set_one, word(1),
      "59 45 52 43 20 00 04 00 03 01 00 03 00 00 00 00 39x8 83 00 01 00 01 10 00 00 01 00 00 00");
  add("write P010", robot, 4, 0x7F, 10, 0, Service::set_all, position_data(p010()),
      "59 45 52 43 20 00 34 00 03 01 00 04 00 00 00 00 39x8 7f 00 0a 00 00 02 00 00 "
      "11 00 00 00 04 00 00 00 01 00 00 00 00 00 00 00 00 00 00 00 d4 65 0c 00 c6 68 fe ff 28 8e 03 00 40 77 1b 00 "
      "00 00 00 00 d0 dd 06 00 00x8");
  add("write B000", robot, 5, 0x7A, 0, 1, Service::set_one, std::string(1, 1),
      "59 45 52 43 20 00 01 00 03 01 00 05 00 00 00 00 39x8 7a 00 00 00 01 10 00 00 01");
  add("read pose R1", robot, 7, 0x75, 101, 0, Service::get_all, "",
      "59 45 52 43 20 00 00 00 03 01 00 07 00 00 00 00 39x8 75 00 65 00 00 01 00 00");
  add("start", robot, 8, 0x86, 1, 1, Service::set_one, word(1),
      "59 45 52 43 20 00 04 00 03 01 00 08 00 00 00 00 39x8 86 00 01 00 01 10 00 00 01 00 00 00");
  add("select BPICK", robot, 9, 0x87, 1, 0, Service::set_all, "BPICK" + std::string(27 + 4, '\0'),
      "59 45 52 43 20 00 24 00 03 01 00 09 00 00 00 00 39x8 87 00 01 00 00 02 00 00 42 50 49 43 4b 00x27 00x4");
  add("list *.JBI", Division::file, 12, 0, 0, 0, Service::file_list, "*.JBI",
      "59 45 52 43 20 00 05 00 03 02 00 0c 00 00 00 00 39x8 00 00 00 00 00 32 00 00 2a 2e 4a 42 49");
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    const std::string wanted = bytes(vector.wanted);
    EXPECT_EQ(bytes_of(vector.request), wanted);
    const auto back = request_of(wanted);
    ASSERT_TRUE(back);
    EXPECT_EQ(bytes_of(*back), wanted);
  }
  const Request move{robot, 6, 0, false, 0x8A, 2, 1, Service::set_all, move_data(100, p010())};
  const std::string first = bytes(
      "59 45 52 43 20 00 68 00 03 01 00 06 00 00 00 00 39x8 8a 00 02 00 01 02 00 "
      "00 01 00 00 00 00 00 00 00 "
      "01 00 00 00 e8 03 00 00 11 00 00 00");
  EXPECT_EQ(bytes_of(move).substr(0, first.size()), first);
  EXPECT_EQ(bytes_of(move).size(), 32u + 104u);

  const std::string status = bytes(
      "59 45 52 43 20 00 08 00 03 01 01 01 00 00 00 00 39x8 81 00 00 00 00 00 00 "
      "00 c2 00 00 00 40 00 00 00");
  const auto answer = answer_of(status);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->id, 1);
  EXPECT_EQ(get32(answer->data, 0), 0xc2);
  EXPECT_EQ(bytes_of(*answer), status);
  const std::string error = bytes(
      "59 45 52 43 20 00 00 00 03 01 01 0d 00 00 00 00 39x8 90 1f 02 00 60 20 00 "
      "00");
  const auto refusal = answer_of(error);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->status, 0x1f);
  EXPECT_EQ(decimal_digits(refusal->added), 2060);
  EXPECT_EQ(bytes_of(*refusal), error);
}

TEST(HsesPackets, ConvertFormBitsAndPositions) {
  EXPECT_EQ(hses_form(1), 4);  // no flip
  EXPECT_EQ(hses_form(2), 2);
  EXPECT_EQ(hses_form(4), 1);  // back
  for (int form = 0; form < 64; ++form) EXPECT_EQ(form_bits_of(hses_form(form)), form);
  const auto back = hses::position_of(position_data(p010()));
  ASSERT_TRUE(back);
  EXPECT_TRUE(same_position(*back, p010(), 1e-4));
  const PulsePosition pulses{{1, -2, 3, -4, 5, -6}, 2};
  EXPECT_TRUE(same_position(*hses::position_of(position_data(pulses)), pulses, 1e-4));
  CartesianPosition user = p010();
  user.frame = 2;
  EXPECT_THROW(position_data(user), ControllerError);
  user.frame = 1;
  user.numbers[0] = std::nan("");
  EXPECT_THROW(position_data(user), ControllerError);
  EXPECT_EQ(hex_digits(2060), 0x2060);
  EXPECT_EQ(decimal_digits(0xB001), 0);
}

TEST(HsesPackets, AnythingElseIsNone) {
  const std::string good = bytes_of(Request{});
  ASSERT_TRUE(request_of(good));
  EXPECT_FALSE(answer_of(good));
  for (std::size_t n = 0; n < good.size(); ++n) EXPECT_FALSE(request_of(good.substr(0, n))) << n;
  EXPECT_FALSE(request_of(good + "x"));
  for (const std::size_t i : {0u, 3u, 4u, 6u, 9u, 10u}) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x55);
    EXPECT_FALSE(request_of(bad)) << i;
  }
}

/// Answers as a test says, packet by packet; an empty answer is a loss.
class ScriptedDatagrams : public DatagramLink {
 public:
  std::deque<std::function<std::string(const Request&)>> script;
  std::vector<Request> requests;
  void send(std::string_view packet) override {
    requests.push_back(*request_of(packet));
    if (script.empty()) return;
    incoming_.push_back(script.front()(requests.back()));
    script.pop_front();
  }
  std::string receive(double timeout_s) override {
    if (incoming_.empty() || incoming_.front().empty()) {
      incoming_.clear();
      clock->sleep_s(timeout_s);
      return {};
    }
    const std::string packet = incoming_.front();
    incoming_.pop_front();
    return packet;
  }
  Clock* clock = nullptr;

 private:
  std::deque<std::string> incoming_;
};

struct StillClock : Clock {
  double now_s() override { return now; }
  void sleep_s(double seconds) override { now += seconds; }
  double now = 0;
};

std::string answer_to(const Request& request, std::string data, std::uint8_t status = 0, std::uint16_t added = 0,
                      int id_shift = 0) {
  Answer answer;
  answer.id = static_cast<std::uint8_t>(request.id + id_shift);
  answer.service = static_cast<std::uint8_t>(request.service);
  answer.status = status;
  answer.added = added;
  answer.data = std::move(data);
  return bytes_of(answer);
}

struct HsesClientTest : testing::Test {
  HsesClientTest() {
    auto owned = std::make_unique<ScriptedDatagrams>();
    link = owned.get();
    link->clock = &clock;
    client = make_hses(std::move(owned), clock);
  }
  StillClock clock;
  ScriptedDatagrams* link;
  std::unique_ptr<Controller> client;
};

TEST_F(HsesClientTest, RepeatsWhatReadsWithNewNumbers) {
  link->script = {[](const Request&) { return std::string(); },
                  [](const Request& r) { return answer_to(r, word(0xc2) + word(0x40), 0, 0, -1); },  // an old one
                  [](const Request& r) { return answer_to(r, word(0xc2) + word(0x40)); }};
  EXPECT_TRUE(client->status().ready());
  ASSERT_EQ(link->requests.size(), 3u);
  EXPECT_NE(link->requests[0].id, link->requests[1].id);
}

TEST_F(HsesClientTest, NeverRepeatsWhatMovesOrWrites) {
  const auto fault_of = [&](auto command) {
    link->requests.clear();
    try {
      command();
    } catch (const ControllerError& error) {
      return error.fault();
    }
    return ControllerFault::bad_answer;
  };
  EXPECT_EQ(fault_of([&] { client->start_job(""); }), ControllerFault::unknown_outcome);
  EXPECT_EQ(link->requests.size(), 1u);
  EXPECT_EQ(fault_of([&] { client->write_byte(0, 1); }), ControllerFault::unknown_outcome);
  EXPECT_EQ(link->requests.size(), 1u);
  EXPECT_EQ(fault_of([&] { client->hold(false); }), ControllerFault::unknown_outcome);
  EXPECT_EQ(link->requests.size(), 1u);
  EXPECT_EQ(fault_of([&] { client->hold(true); }), ControllerFault::unknown_outcome);
  EXPECT_EQ(link->requests.size(), 5u);  // to stop again does no harm
}

TEST_F(HsesClientTest, NamesWhatIsRefused) {
  link->script = {[](const Request& r) { return answer_to(r, "", 0x1f, 0x2060); }};
  try {
    client->start_job("");
    FAIL();
  } catch (const ControllerError& error) {
    EXPECT_EQ(error.fault(), ControllerFault::refused);
    EXPECT_EQ(error.number(), 2060);
  }
}

}  // namespace
}  // namespace tribin
