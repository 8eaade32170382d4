#include "tribin/robot/text_protocol.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using namespace robot;

struct StillClock : Clock {
  double now_s() override { return now; }
  void sleep_s(double seconds) override { now += seconds; }
  double now = 100;
};

/// Picks in a row along x, looking down with Rx, Ry, Rz = 10, 20, 30 deg.
TextScene scene_of(int picks, bool places = false) {
  TextScene scene;
  for (int i = 1; i <= picks; ++i) {
    TextPick pick;
    pick.id = i;
    pick.part_class = 1 + i % 2;
    for (int step = 0; step < 3; ++step) {
      Pose pose = Pose::Identity();
      pose.linear() = rotation_from_yaskawa({10, 20, 30});
      pose.translation() = Vec3(100 * i, -0.0000004, step == 1 ? 50 : 150);
      pick.pick[static_cast<std::size_t>(step)] = pose;
      if (places) pick.place.push_back(pose);
    }
    scene.picks.push_back(pick);
  }
  return scene;
}

struct TextTest : testing::Test {
  TextTest() {
    options.limits.workspace = Box{Vec3(-1000, -1000, 0), Vec3(1000, 1000, 1000)};
    vision.scan = [this] {
      ++scans;
      return scene;
    };
    vision.report = [this](int, const TextPick& pick, int result) { reports.emplace_back(pick.id, result); };
  }
  std::string say(const std::string& line) {
    if (!session) session.emplace(vision, options, clock);
    return session->receive(line + "\r\n");
  }
  StillClock clock;
  TextVision vision;
  TextOptions options;
  TextScene scene = scene_of(4);
  int scans = 0;
  std::vector<std::pair<int, int>> reports;
  std::optional<TextSession> session;
};

TEST_F(TextTest, ServesACycle) {
  EXPECT_EQ(say("HELLO,1,yaskawa"), "100,1,tribin\r\n");
  EXPECT_EQ(say("GET,3"), "410\r\n");
  EXPECT_EQ(say("SCAN"), "201,1,4\r\n");
  EXPECT_EQ(say("GET,5"),
            "200,1,3,3\r\n"
            "P,1,1,2,100.000,0.000,150.000,10.0000,20.0000,30.0000\r\n"
            "P,1,2,2,100.000,0.000,50.000,10.0000,20.0000,30.0000\r\n"
            "P,1,3,2,100.000,0.000,150.000,10.0000,20.0000,30.0000\r\n");
  EXPECT_TRUE(say("GET,300").starts_with("200,1,9,0\r\nP,2,1,1,200.000,"));
  EXPECT_EQ(say("GET,3"), "200,1,0,0\r\n");
  EXPECT_EQ(say("DONE,1,1"), "202\r\n");
  EXPECT_EQ(reports, (std::vector<std::pair<int, int>>{{1, 1}}));
  EXPECT_EQ(say("GET,3"), "411\r\n");  // a part was taken
  EXPECT_EQ(say("DONE,1,4"), "202\r\n");
  EXPECT_EQ(say("SCAN"), "201,2,4\r\n");
  EXPECT_TRUE(say("GET,3").starts_with("200,2,3,3\r\n"));
  EXPECT_EQ(scans, 2);
  EXPECT_EQ(say("BYE"), "202\r\n");
  EXPECT_TRUE(session->over());
  EXPECT_EQ(say("SCAN"), "");
}

TEST_F(TextTest, SpeaksEachBrandsNumbersInLinesThatFit) {
  scene = scene_of(1);
  const std::pair<const char*, const char*> golden[] = {
      {"fanuc", ",10.0000,20.0000,30.0000\r\n"},
      {"KUKA", ",30.0000,20.0000,10.0000\r\n"},
      {"mitsubishi", ",10.0000,20.0000,30.0000\r\n"},
      {"kawasaki", ",2.7268,22.2687,25.5056\r\n"},
      {"abb", ",0.951549,0.038135,0.189308,0.239298\r\n"},
      {"ur", ",0.077525,0.384852,0.486479\r\n"},
      {"ros", "P,1,1,2,0.100000,0.000000,0.150000,0.038135,0.189308,0.239298,0.951549\r\n"}};
  for (const auto& [name, numbers] : golden) {
    SCOPED_TRACE(name);
    EXPECT_EQ(say(std::string("HELLO,1,") + name), "100,1,tribin\r\n");
    say("SCAN");
    const std::string answer = say("GET,3");
    EXPECT_NE(answer.find(numbers), std::string::npos) << answer;
    std::size_t from = 0;
    for (std::size_t end; (end = answer.find("\r\n", from)) != std::string::npos; from = end + 2)
      EXPECT_LE(end - from, kLongestTextLine);
  }
}

TEST_F(TextTest, RefusesWithANumber) {
  EXPECT_EQ(say("SCAN"), "409\r\n");
  EXPECT_TRUE(say("HELLO,2,kuka").starts_with("403,"));
  EXPECT_TRUE(say("HELLO,1").starts_with("402,"));
  EXPECT_TRUE(say("HELLO,1,acme").starts_with("405,"));
  EXPECT_EQ(say(" hello , 1.0 , Kuka "), "100,1,tribin\r\n");
  EXPECT_TRUE(say("DANCE").starts_with("400,"));
  EXPECT_TRUE(say("GET").starts_with("402,"));
  EXPECT_TRUE(say("GET,x").starts_with("402,"));
  EXPECT_TRUE(say("GET,2").starts_with("403,"));
  EXPECT_TRUE(say("GET,1e9").starts_with("402,"));
  EXPECT_TRUE(say("SCAN,1").starts_with("402,"));
  say("SCAN");
  EXPECT_EQ(say("PLACE,1"), "404\r\n");
  EXPECT_EQ(say("DONE,99,1"), "404\r\n");
  EXPECT_TRUE(say("DONE,1,5").starts_with("403,"));
  clock.now += 11;  // the scan is too old
  EXPECT_EQ(say("GET,3"), "410\r\n");
}

TEST_F(TextTest, SaysWhyThereIsNothingToPick) {
  say("HELLO,1,kuka");
  scene.picks.clear();
  EXPECT_EQ(say("SCAN"), "205,1,0\r\n");
  scene.status = TextStatus::bin_empty;
  EXPECT_EQ(say("SCAN"), "204,2,0\r\n");
  scene = scene_of(2);
  scene.picks[0].pick[1].translation().z() = -5;  // outside the workspace
  scene.picks[1].pick[2].translation().x() = std::nan("");
  EXPECT_EQ(say("SCAN"), "206,3,0\r\n");
  EXPECT_EQ(say("GET,3"), "200,3,0,0\r\n");
  vision.scan = []() -> TextScene {
    throw Error(ErrorCode::device, "the camera,\nit is gone " + std::string(200, 'x'));
  };
  session.reset();
  say("HELLO,1,kuka");
  const std::string answer = say("SCAN");
  EXPECT_TRUE(answer.starts_with("500,the camera  it is gone")) << answer;
  EXPECT_LE(answer.size(), kLongestTextLine + 2);
  EXPECT_EQ(say("GET,3"), "410\r\n");
}

TEST_F(TextTest, GivesPlacesAndAsksForItsKey) {
  scene = scene_of(2, true);
  options.key = "secret";
  EXPECT_EQ(say("HELLO,1,kuka"), "401\r\n");
  EXPECT_TRUE(session->over());
  session.reset();
  EXPECT_EQ(say("HELLO,1,kuka,secret"), "100,1,tribin\r\n");
  say("SCAN");
  const std::string answer = say("PLACE,2");
  EXPECT_TRUE(answer.starts_with("200,1,3,0\r\nP,2,4,1,200.000,")) << answer;
}

TEST_F(TextTest, TakesAnyLineEndsInAnySegmentsAndNoGarbage) {
  for (const std::string end : {"\r", "\n", "\r\n"}) {
    session.emplace(vision, options, clock);
    std::string out;
    for (const char c : "HELLO,1,kuka" + end + "SCAN" + end + end) out += session->receive(std::string(1, c));
    EXPECT_EQ(out, "100,1,tribin\r\n201,1,4\r\n");
  }
  session.emplace(vision, options, clock);
  EXPECT_EQ(session->receive(std::string(10 << 20, 'x')), "413\r\n");
  EXPECT_TRUE(session->over());
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    session.emplace(vision, options, clock);
    std::string bytes = "HELLO,1,kuka\r";
    for (int k = 0; k < 60; ++k) bytes += "SCANGET,0123456789.-+\r\n\0xyz"[random() % 27];
    session->receive(bytes);
  }
}

TEST(TextServer, ServesOneProgramAtATimeOnLoopbackOnly) {
  TextVision vision;
  vision.scan = [] { return scene_of(1); };
  TextOptions options;
  options.limits.workspace = Box{Vec3(-1000, -1000, 0), Vec3(1000, 1000, 1000)};
  EXPECT_THROW(TextServer(vision, options, "0.0.0.0", 0), Error);  // not without setting and key
  const TextServer server(vision, options, "127.0.0.1", 0);
  const auto clock = make_clock();
  const auto ask = [](ByteStream& stream, const std::string& line, std::size_t bytes) {
    stream.send(line);
    std::string out;
    while (out.size() < bytes) {
      const auto received = stream.receive(5);
      if (received.bytes.empty()) break;
      out += received.bytes;
    }
    return out;
  };
  {
    const auto first = tcp_stream("127.0.0.1", server.port(), *clock);
    first->open(5);
    EXPECT_EQ(ask(*first, "HELLO,1,ur\r\n", 14), "100,1,tribin\r\n");
    const auto second = tcp_stream("127.0.0.1", server.port(), *clock);
    second->open(5);
    EXPECT_EQ(ask(*second, "", 5), "503\r\n");
    EXPECT_EQ(ask(*first, "SCAN\n", 9), "201,1,1\r\n");
  }
  const auto third = tcp_stream("127.0.0.1", server.port(), *clock);
  for (int i = 0; i < 50; ++i) {  // until the first one's end is seen
    third->open(5);
    if (ask(*third, "HELLO,1,ur\r\n", 14) == "100,1,tribin\r\n") return;
    clock->sleep_s(0.05);
  }
  ADD_FAILURE() << "the next program is not served";
}

}  // namespace
}  // namespace tribin
