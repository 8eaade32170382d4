#pragma once

#include "picking/chooser.hpp"

namespace tribin::picking {

inline constexpr int kMostFailures = 10;      // grips in a row that held nothing: something else is wrong
inline constexpr std::size_t kMostStops = 6;  // of one command
inline constexpr Chooser::Where kAllPlaces[] = {Chooser::Where::slots, Chooser::Where::station, Chooser::Where::turned};

/// For people: what software refuses; the most frequent reasons of a plan.
std::string text_of(const std::vector<std::string>& texts);
std::string text_of(const std::vector<grasp::WhyCount>& reasons);

/// How an order ended, for the journal.
Entry end_of(const Entry& order, robot::CycleResult result);
/// \throws Error device for a fault of the robot's job
void must_be_no_fault(const Entry& order, robot::CycleResult result);
/// The command of an entry. Places of two arms are in the base's frame, since their robot's turns with the waist.
robot::CycleOrder order_of(const Entry& entry, robot::CycleCommand command, const Chooser& chooser,
                           const robot::Arm& arm, const std::vector<Stop>& stops, const std::string& gripper);
/// The journal's entry of a pick.
Entry pick_of(const Choice& choice, int scene);
/// Whether the controller tells how an arm's open order ended; it is in the journal then. (recover.cpp)
bool settle(const RunLinks& links, const robot::HandshakeOptions& shake, int arm);
/// "the pick of alternator_a": for people.
std::string what_was_ordered(const Entry& entry);

/// Two arms: one in the bin while the other is at the rack. (two_arms.cpp)
RunEnd pick_with_two_arms(const RunLinks& links, const RunOptions& options);

/// One run of the cycle, from phase to phase.
class Run {
 public:
  Run(const RunLinks& links, const RunOptions& options);
  RunEnd go();

 private:
  // The phases; each gives the next one. (cycle.cpp, recover.cpp, resorts.cpp)
  Phase recover();
  Phase scan();
  Phase choose();
  Phase pick();
  Phase show();
  Phase place();
  Phase regrasp();
  Phase push();

  // show.cpp
  /// What comes when a part is in the hand.
  Phase with_part() const;
  Phase measured(const Entry& held, const HeldPose& pose);

  // recover.cpp
  void take_answer();
  Phase in_doubt(const std::string& what);

  // Orders, each in the journal before it is given. (orders.cpp)
  robot::CycleResult order(Entry entry, robot::CycleCommand command, const std::vector<Stop>& stops,
                           const std::string& gripper, double opening_mm, int part_class);
  /// Through way points to where `to` begins. \throws Error device where no way is in reach
  void travel(const Pose& to, const std::string& gripper);
  /// A camera on the flange: the arm goes to where it looks from, and tells where that is. \return none for a fixed one
  FlangePose go_to_look();
  const Gripper& gripper_now() const;  ///< as the controller tells
  void lift_to_change(const std::string& gripper);
  /// A fixed camera sees the arm where it picks: it leaves the bin before a scan.
  void step_aside();
  bool carry_out_pick(const Choice& choice, int scene, bool from_station);
  const Chooser::Start& here();

  Phase finish(const std::string& status, const std::string& message);
  Phase next_resort();
  void tell(const std::string& state, const std::string& note = {});
  const JournalState& now() const { return journal_.state(); }
  /// The kinds of place that a part may go to now.
  std::vector<Chooser::Where> wheres() const;
  /// Parts that a gripper has missed twice where they lie.
  std::vector<Chooser::Avoid> to_avoid() const;

  const RunLinks& links_;
  const RunOptions& options_;
  Journal& journal_;
  Chooser chooser_;
  Sight sight_;
  std::optional<Choice> choice_;
  CycleReport report_;
  Resort resort_ = Resort::none;
  int scene_ = 0, pushes_ = 0, failures_ = 0, turns_ = 0, look_ = 0;
  double scan_s_ = 0;
  std::string station_trouble_;  ///< why what stands at the station stays there; empty = it does not
  struct Failed {
    grasp::FailedPick pick;
    Vec3 part_at;
    int scene;
  };
  std::vector<Failed> failed_;
  std::optional<Grip> grip_;            ///< of what is in the hand
  std::optional<Chooser::Start> here_;  ///< where the arm was sent last
  RunEnd end_;
};

}  // namespace tribin::picking
