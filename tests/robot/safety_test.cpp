// Each refusal has a case that triggers it, and it alone.
#include "tribin/robot/safety.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>

#include "support/arms.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin {
namespace {

using namespace robot;

Pose down_at(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0));
  pose.translation() = Vec3(x, y, z);
  return pose;
}

const Arm& arm() {
  static const Arm arm = test::gp110();
  return arm;
}

SafetyLimits limits() {
  SafetyLimits limits;
  limits.allow_arm = true;
  limits.workspace = Box{Vec3(-1500, -1500, -200), Vec3(1500, 1500, 2000)};
  limits.forbidden = {{Vec3(-100, 900, 0), Vec3(100, 1100, 500)}};
  limits.tools = {1};
  return limits;
}

CommandFacts motion() {
  CommandFacts command;
  command.kind = CommandKind::motion;
  command.arm = true;
  command.status = status_from_bytes(194, 64);
  MotionFacts& m = command.motion;
  m.base_from_tcp = {down_at(1000, 100, 700), down_at(1000, 100, 600), down_at(1000, 100, 800)};
  m.arm_from_flange = m.base_from_tcp;
  m.arm = &arm();
  m.tool = 1;
  m.scan = ScanFacts{};
  m.hand_eye = HandEyeFacts{10, 0.25};
  m.slot = SlotFacts{};
  return command;
}

std::vector<RefusalCode> codes(const CommandFacts& command, const SafetyLimits& with = limits()) {
  std::vector<RefusalCode> out;
  for (const Refusal& refusal : refusals(command, with)) {
    out.push_back(refusal.code);
    EXPECT_FALSE(refusal.message.empty());
  }
  return out;
}

using Case = std::function<void(CommandFacts&, SafetyLimits&)>;

TEST(Safety, EveryRefusalIsTriggeredByItsCaseAlone) {
  const double nan = std::nan("");
  std::map<RefusalCode, std::vector<Case>> cases;
  const auto on = [&cases](RefusalCode code, Case make) { cases[code].push_back(std::move(make)); };
  on(RefusalCode::dry_run, [](auto& c, auto&) { c.arm = false; });
  on(RefusalCode::arm_not_allowed, [](auto&, auto& l) { l.allow_arm = false; });
  for (const char* address : {"0.0.0.0", "192.168.255.2", "::", "example.org", ""})
    for (const bool setting : {false, true})
      for (const bool key : {false, true})
        if (!(setting && key))
          on(RefusalCode::not_loopback, [=](auto& c, auto& l) {
            c.kind = CommandKind::listen;
            c.listen_address = address;
            l.allow_remote_clients = setting;
            c.has_key = key;
          });
  on(RefusalCode::second_client, [](auto& c, auto&) { c.other_client_moves = true; });
  on(RefusalCode::operator_needed, [](auto& c, auto&) { c.kind = CommandKind::operator_action; });
  on(RefusalCode::no_status, [](auto& c, auto&) { c.status.reset(); });
  on(RefusalCode::no_status, [](auto& c, auto&) { c.status_age_s = 0.3; });
  on(RefusalCode::no_status, [nan](auto& c, auto&) { c.status_age_s = nan; });
  on(RefusalCode::not_remote, [](auto& c, auto&) { c.status->remote = false; });
  on(RefusalCode::not_play, [](auto& c, auto&) { c.status->play = false; });
  on(RefusalCode::not_play, [](auto& c, auto&) { c.status->teach = true; });
  on(RefusalCode::alarm, [](auto& c, auto&) { c.status->alarm = true; });
  on(RefusalCode::error, [](auto& c, auto&) { c.status->error = true; });
  on(RefusalCode::held, [](auto& c, auto&) { c.status->held_by_pendant = true; });
  on(RefusalCode::held, [](auto& c, auto&) { c.status->held_externally = true; });
  on(RefusalCode::held, [](auto& c, auto&) { c.status->held_by_command = true; });
  on(RefusalCode::servo_off, [](auto& c, auto&) { c.status->servo_on = false; });
  on(RefusalCode::running, [](auto& c, auto&) { c.status->running = true; });
  on(RefusalCode::not_finite, [nan](auto& c, auto&) { c.motion.arm_from_flange[0].translation().x() = nan; });
  on(RefusalCode::not_finite, [](auto& c, auto&) { c.motion.arm_from_flange[1].linear()(0, 0) = HUGE_VAL; });
  on(RefusalCode::not_rotation, [](auto& c, auto&) { c.motion.base_from_tcp[2].linear() *= 1.01; });
  on(RefusalCode::not_rotation, [](auto& c, auto&) { c.motion.base_from_tcp[2].linear().col(0) *= -1; });
  on(RefusalCode::workspace, [](auto& c, auto&) { c.motion.base_from_tcp[1].translation().z() = -201; });
  on(RefusalCode::workspace, [](auto&, auto& l) { l.workspace.reset(); });
  on(RefusalCode::forbidden, [](auto& c, auto&) { c.motion.base_from_tcp[1] = down_at(0, 1000, 300); });
  on(RefusalCode::scan_old, [](auto& c, auto&) { c.motion.scan->age_s = 10.1; });
  on(RefusalCode::scan_old, [nan](auto& c, auto&) { c.motion.scan->age_s = nan; });
  on(RefusalCode::scan_other, [](auto& c, auto&) { c.motion.scan->scene = 3; });
  on(RefusalCode::scene_changed, [](auto& c, auto&) { c.motion.scan->changed = true; });
  on(RefusalCode::confidence, [](auto& c, auto&) { c.motion.scan->score = 0.89; });
  on(RefusalCode::visibility, [](auto& c, auto&) { c.motion.scan->visible = 0.19; });
  on(RefusalCode::no_solution, [](auto& c, auto&) { c.motion.arm_from_flange[1] = down_at(5000, 0, 500); });
  // With a first axis that cannot turn round, what lies behind is reached by leaning back only.
  on(RefusalCode::form_change, [](auto& c, auto&) {
    static const Arm narrow = [] {
      Arm out = test::gp110();
      out.joints[0].min = -60 * kDegree, out.joints[0].max = 60 * kDegree;
      return out;
    }();
    const double degrees[2][6] = {{0, 0, 0, 10, -60, 0}, {0, -70, 70, 10, -60, 0}};
    c.motion.arm_from_flange.clear();
    for (const auto& row : degrees) {
      Joints joints{};
      for (int k = 0; k < 6; ++k) joints[k] = row[k] * kDegree;
      c.motion.arm_from_flange.push_back(arm_from_flange(narrow, joints));
    }
    c.motion.arm = &narrow;
  });
  on(RefusalCode::limit_margin, [](auto&, auto& l) { l.limit_margin_rad = 1.5; });
  on(RefusalCode::singularity, [](auto&, auto& l) { l.singularity = 0.9999; });
  on(RefusalCode::speed, [](auto& c, auto&) { c.motion.speed_mm_s = 251; });
  on(RefusalCode::speed, [](auto& c, auto&) { c.motion.joint_speed_percent = 11; });
  on(RefusalCode::tool, [](auto& c, auto&) { c.motion.tool = 2; });
  on(RefusalCode::tool, [](auto&, auto& l) { l.tools.clear(); });
  on(RefusalCode::frame, [](auto& c, auto&) { c.motion.frame = 2; });
  on(RefusalCode::hand_eye_missing, [](auto& c, auto&) { c.motion.hand_eye.reset(); });
  on(RefusalCode::hand_eye_old, [](auto& c, auto&) { c.motion.hand_eye->age_days = 181; });
  on(RefusalCode::hand_eye_poor, [](auto& c, auto&) { c.motion.hand_eye->sigma_mm = 1.1; });
  on(RefusalCode::slot_occupied, [](auto& c, auto&) { c.motion.slot->occupied = true; });
  on(RefusalCode::slot_class, [](auto& c, auto&) { c.motion.slot->class_allowed = false; });

  EXPECT_TRUE(codes(motion()).empty());
  for (int i = 0; i < kRefusalCodes; ++i) {
    const auto code = static_cast<RefusalCode>(i);
    SCOPED_TRACE(name_of(code));
    ASSERT_FALSE(cases[code].empty());
    for (const Case& make : cases[code]) {
      CommandFacts command = motion();
      SafetyLimits with = limits();
      make(command, with);
      auto found = codes(command, with);
      found.erase(std::unique(found.begin(), found.end()), found.end());  // one reason for several poses
      EXPECT_EQ(found, std::vector<RefusalCode>{code});
      EXPECT_THROW(require_allowed(command, with), Error);
    }
  }
}

TEST(Safety, ReadingAndStoppingAreNeverRefused) {
  for (const CommandKind kind : {CommandKind::read, CommandKind::stop}) {
    CommandFacts command;
    command.kind = kind;
    EXPECT_TRUE(codes(command, SafetyLimits{}).empty());
  }
}

TEST(Safety, WithoutAnyConfigurationNothingMoves) {
  CommandFacts command;
  command.kind = CommandKind::motion;
  EXPECT_GE(codes(command, SafetyLimits{}).size(), 5u);
  EXPECT_EQ(SafetyLimits{}.speed_mm_s, 250);
  EXPECT_FALSE(SafetyLimits{}.allow_arm);
}

TEST(Safety, OnlyThisMachineIsLoopback) {
  for (const char* address : {"127.0.0.1", "127.1.2.3", "::1", "localhost"})
    EXPECT_TRUE(is_loopback(address)) << address;
  for (const char* address : {"0.0.0.0", "128.0.0.1", "10.0.0.1", "", "127.0.0.1.example.org"})
    EXPECT_FALSE(is_loopback(address)) << address;
}

TEST(Watchdog, HoldsForEachOfItsReasons) {
  WatchFacts good;
  good.now_s = 100, good.status_s = 99.9, good.client_s = 99.5, good.scan_s = 80;
  good.expected_mm = Vec3(1, 2, 3), good.seen_mm = Vec3(1, 2, 40);
  EXPECT_EQ(hold_reason(good), "");
  const std::pair<const char*, std::function<void(WatchFacts&)>> cases[] = {
      {"operator", [](WatchFacts& f) { f.operator_stop = true; }},
      {"controller", [](WatchFacts& f) { f.status_s = 98; }},
      {"client", [](WatchFacts& f) { f.client_s = 97; }},
      {"scan", [](WatchFacts& f) { f.scan_s = 30; }},
      {"tool", [](WatchFacts& f) { f.seen_mm = Vec3(1, 2, 60); }},
      {"tool", [](WatchFacts& f) { f.seen_mm = Vec3(std::nan(""), 2, 3); }},
      {"controller", [](WatchFacts& f) { f.now_s = std::nan(""); }}};
  for (const auto& [word, make] : cases) {
    WatchFacts facts = good;
    make(facts);
    EXPECT_NE(hold_reason(facts).find(word), std::string::npos) << hold_reason(facts);
  }
}

struct GuardedTest : testing::Test {
  GuardedTest() { machine.add_job(controller_sim::parse_job(controller_sim::handshake_job(), "BPICK")); }
  std::unique_ptr<Controller> guarded(bool arm) {
    return make_guarded(make_nx100(controller_sim::virtual_stream(wire, clock), clock), limits(), arm,
                        [this](const std::string& line) { said.push_back(line); });
  }
  static CartesianPosition position(double x, int tool = 1) { return {1, {x, 0, 500, 180, 0, 0}, 1, tool, 0}; }
  controller_sim::Machine machine;
  controller_sim::Wire wire{machine, {}};
  controller_sim::VirtualClock clock;
  std::vector<std::string> said;
};

TEST_F(GuardedTest, InADryRunNothingButReadingAndStoppingLeaves) {
  const auto client = guarded(false);
  EXPECT_TRUE(client->status().play);
  const auto token = OperatorToken::confirm("k", "k");
  EXPECT_THROW(client->write_byte(0, 1), ControllerError);
  EXPECT_THROW(client->write_integer(0, 1), ControllerError);
  EXPECT_THROW(client->write_position(1, position(600)), ControllerError);
  EXPECT_THROW(client->start_job("BPICK"), ControllerError);
  EXPECT_THROW(client->hold(false), ControllerError);
  EXPECT_THROW(client->set_servo(false, token), ControllerError);
  EXPECT_THROW(client->reset_alarm(token), ControllerError);
  EXPECT_THROW(client->cancel_error(token), ControllerError);
  EXPECT_THROW(client->set_play_mode(false, token), ControllerError);
  EXPECT_THROW(client->delete_job("BPICK", token), ControllerError);
  EXPECT_EQ(said.size(), 10u);
  EXPECT_EQ(machine.bytes[0], 0);
  EXPECT_TRUE(machine.positions.empty());
  EXPECT_FALSE(machine.status().running);
  client->hold(true);
  EXPECT_TRUE(machine.status().held_by_command);
}

TEST_F(GuardedTest, PositionsAndStartsPassTheGate) {
  auto client = guarded(true);
  client->write_position(1, position(600));
  EXPECT_THROW(client->write_position(1, position(1600)), ControllerError);
  EXPECT_THROW(client->write_position(1, position(std::nan(""))), ControllerError);
  EXPECT_THROW(client->write_position(1, position(600, 2)), ControllerError);
  EXPECT_THROW(client->write_position(1, PulsePosition{{0, 0, 0, 0, 0, 0}, 1}), ControllerError);
  EXPECT_EQ(std::get<CartesianPosition>(machine.positions.at(1)).numbers[0], 600);
  machine.hold_by_pendant(true);
  EXPECT_THROW(client->start_job("BPICK"), ControllerError);
  machine.hold_by_pendant(false);
  client->start_job("BPICK");
  EXPECT_TRUE(machine.status().running);
  client.reset();  // the program ends: the robot is left on hold
  EXPECT_TRUE(machine.status().held_by_command);
  EXPECT_FALSE(machine.status().running);
}

}  // namespace
}  // namespace tribin
