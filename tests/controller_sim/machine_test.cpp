// The machine's states, its interpreter and its motion.
#include "tribin/controller_sim/machine.hpp"

#include <gtest/gtest.h>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using namespace controller_sim;

std::string job(const std::string& instructions) {
  return "/JOB\r\n//NAME TEST\r\n//POS\r\n///NPOS 2,0,0,0,0,0\r\n///TOOL 1\r\n///POSTYPE ROBOT\r\n///RECTAN\r\n"
         "///RCONF 1,0,0,0,0,0\r\nC00000=600.000,0.000,300.000,180.00,0.00,0.00\r\n"
         "C00001=600.000,-400.000,500.000,180.00,0.00,90.00\r\n//INST\r\n///ATTR SC,RW\r\n///GROUP1 RB1\r\nNOP\r\n" +
         instructions + "END\r\n";
}

void run(Machine& machine, double seconds) {
  const double until = machine.now_s() + seconds;
  while (machine.now_s() < until) machine.advance(std::min(until, machine.now_s() + 0.013));
}

Machine with_job(const std::string& instructions) {
  Machine machine;
  machine.add_job(parse_job(job(instructions), "test"));
  return machine;
}

TEST(Interpreter, CalculatesJumpsAndEnds) {
  Machine machine = with_job(
      "SET B001 3\r\nSET D001 0\r\n*LOOP\r\nADD D001 B001\r\nDEC B001\r\nINC I005\r\nJUMP *LOOP IF B001>0\r\n"
      "SET R002 2.5\r\nSUB D001 1\r\n");
  EXPECT_EQ(machine.start("TEST"), 0);
  run(machine, 1);
  EXPECT_EQ(machine.doubles[1], 5);
  EXPECT_EQ(machine.integers[5], 3);
  EXPECT_EQ(machine.reals[2], 2.5);
  EXPECT_FALSE(machine.status().running);
}

TEST(Interpreter, WaitsForInputsAndTimers) {
  Machine machine =
      with_job("WAIT IN#(5)=ON\r\nTIMER T=0.50\r\nDOUT OT#(2) ON\r\nWAIT IN#(6)=ON T=1.00\r\nSET B009 1\r\n");
  machine.start("TEST");
  run(machine, 5);
  EXPECT_FALSE(machine.output(2));
  machine.set_input(5, true);
  run(machine, 0.4);
  EXPECT_FALSE(machine.output(2));
  run(machine, 0.3);
  EXPECT_TRUE(machine.output(2));
  EXPECT_EQ(machine.bytes[9], 0);
  run(machine, 1.2);  // the wait ends without its input
  EXPECT_EQ(machine.bytes[9], 1);
}

TEST(Interpreter, CallsJobsAndStopsWhereThereIsNone) {
  Machine machine =
      with_job("SET B002 1\r\nCALL JOB:SUB IF B002=1\r\nCALL JOB:SUB IF B002=2\r\nINC B008\r\nCALL JOB:NONE\r\n");
  std::string sub = job("INC B007\r\nRET\r\nINC B007\r\n");
  sub.replace(sub.find("TEST"), 4, "SUB");
  machine.add_job(parse_job(sub, "sub"));
  machine.start("TEST");
  run(machine, 1);
  EXPECT_EQ(machine.bytes[7], 1);
  EXPECT_EQ(machine.bytes[8], 1);
  EXPECT_TRUE(machine.status().alarm);
  EXPECT_FALSE(machine.status().running);
}

TEST(Motion, TakesItsTimeAndGoesStraight) {
  Machine machine = with_job("MOVL C00000 V=100.0 PL=0\r\n");
  machine.start("TEST");
  run(machine, 1);
  const auto on_the_way = machine.position();
  EXPECT_LT(on_the_way.numbers[2], 500);
  EXPECT_GT(on_the_way.numbers[2], 300);
  EXPECT_NEAR(on_the_way.numbers[0], 600, 1e-9);
  EXPECT_TRUE(machine.status().running);
  run(machine, 0.9);
  EXPECT_TRUE(machine.status().running);  // 200 mm at 100 mm/s
  run(machine, 0.3);
  EXPECT_FALSE(machine.status().running);
  EXPECT_NEAR(machine.position().numbers[2], 300, 1e-9);
  EXPECT_EQ(machine.moves().size(), 1u);
}

TEST(Motion, HoldStopsItAndStartGoesOnWithTheSameMove) {
  Machine machine = with_job("MOVL C00000 V=100.0 PL=0\r\nMOVL C00001 V=100.0 PL=0\r\n");
  machine.start("TEST");
  run(machine, 1);
  EXPECT_EQ(machine.hold(true), 0);
  const auto held_at = machine.position();
  run(machine, 2);
  EXPECT_EQ(machine.position().numbers, held_at.numbers);
  EXPECT_EQ(machine.start(""), 2050);
  EXPECT_EQ(machine.hold(false), 0);
  run(machine, 2);
  EXPECT_EQ(machine.position().numbers, held_at.numbers);  // nothing resumes by itself
  EXPECT_EQ(machine.start(""), 0);
  run(machine, 10);
  EXPECT_NEAR(machine.position().numbers[1], -400, 1e-9);
  EXPECT_EQ(machine.moves().size(), 2u);  // the one that was stopped counts once
}

TEST(Machine, ChecksInTheOrderOfThePage) {
  Machine machine = with_job("TIMER T=10.00\r\n");
  EXPECT_EQ(machine.start("NONE"), 4040);
  EXPECT_EQ(machine.start("TEST"), 0);
  EXPECT_EQ(machine.start("TEST"), 2010);
  machine.servo(false);
  EXPECT_EQ(machine.start("TEST"), 2070);
  machine.hold(true);
  EXPECT_EQ(machine.start("TEST"), 2050);
  machine.hold_externally(true);
  EXPECT_EQ(machine.start("TEST"), 2040);
  machine.hold_by_pendant(true);
  EXPECT_EQ(machine.start("TEST"), 2020);
  machine.raise_error(1);
  EXPECT_EQ(machine.start("TEST"), 2060);
  machine.mode(false);
  EXPECT_EQ(machine.start("TEST"), 2080);
  machine.set_remote(false);
  EXPECT_EQ(machine.start("TEST"), 2100);
}

TEST(Machine, EmergencyStopAndAlarmsLastAsLongAsTheirCause) {
  Machine machine = with_job("MOVL C00000 V=100.0 PL=0\r\n");
  machine.start("TEST");
  run(machine, 0.5);
  machine.emergency_stop(true);
  EXPECT_FALSE(machine.status().running || machine.status().servo_on);
  EXPECT_EQ(machine.servo(true), 3450);
  machine.reset();
  EXPECT_TRUE(machine.status().alarm);
  machine.emergency_stop(false);
  machine.reset();
  EXPECT_FALSE(machine.status().alarm);
  EXPECT_EQ(machine.servo(true), 0);
  machine.raise_alarm(4107, 0, true);
  machine.reset();
  EXPECT_TRUE(machine.status().alarm);
  machine.remove_cause();
  machine.reset();
  EXPECT_FALSE(machine.status().alarm);
  machine.raise_error(2);
  EXPECT_TRUE(machine.status().error);
  machine.cancel();
  EXPECT_FALSE(machine.status().error);
}

TEST(Machine, APoseOutOfReachIsTakenAndRaisesAnAlarm) {
  Machine machine({.reachable = [](const Pose& pose) { return pose.translation().norm() < 1000; }});
  robot::CartesianPosition far;
  far.numbers = {5000, 0, 0, 0, 0, 0};
  EXPECT_EQ(machine.move(far, 100), 0);
  EXPECT_TRUE(machine.status().alarm);
  EXPECT_FALSE(machine.status().running);
}

TEST(JobFiles, AreReadOrRefusedWithTheirLine) {
  const auto message = [](const std::string& text) {
    try {
      parse_job(text, "X.JBI");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  EXPECT_EQ(message(job("")), "read");
  EXPECT_NE(message(job("FLY P001\r\n")).find("X.JBI, line 15: saw 'FLY P001', wanted an instruction"),
            std::string::npos)
      << message(job("FLY P001\r\n"));
  for (const std::string& bad :
       {std::string(), std::string("hello"), job("JUMP *NONE\r\n"), job("*A\r\n*A\r\n"), job("MOVJ P001\r\n"),
        job("MOVL V=1.0\r\n"), job("SET 1 B001\r\n"), job("TIMER T=x\r\n"), job("DOUT OT#(1) UP\r\n"),
        job("WAIT IN#5=ON\r\n"), std::string("/JOB\r\n//NAME A\r\n//INST\r\nNOP\r\n"), job("JUMP *A IF B001\r\n*A\r\n"),
        job("CALL SUB\r\n")})
    EXPECT_NE(message(bad).find("wanted"), std::string::npos) << bad << message(bad);
}

}  // namespace
}  // namespace tribin
