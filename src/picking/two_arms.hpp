#pragma once

#include <deque>

#include "picking/run.hpp"

/// Two arms of one controller: one is in the bin while the other is at the rack.
///
/// Each round begins and ends with both where they wait, out of the camera's sight. What an arm does in between is an
/// errand in one zone, planned as a whole before it begins: the errand of the arm that holds a part first, then that of
/// the other, whose arm, gripper and part keep clear of all the room that the first one passes through. So it does not
/// matter which is faster. At the station, an arm has both zones. Where no grasp is that clear, the errands come one
/// after the other. Who is in a zone stands in the controller, whose jobs do not go where another is.
namespace tribin::picking {

/// One order to the hand-shake.
struct Move {
  Entry entry;
  robot::CycleCommand command = robot::CycleCommand::way_points;
  std::vector<Stop> stops;
  double opening_mm = 0;
  int part_class = 0;
};

/// What one arm does, from where it waits and back to there.
struct Errand {
  int arm = 1;
  std::vector<robot::Zone> zones;  ///< that are its own meanwhile
  std::string gripper;
  std::deque<Move> moves;
  std::vector<grasp::Convex> room;  ///< boxes that arm, gripper and part stay in; base frame
  CycleReport report;
  std::optional<Entry> open;  ///< ordered, and not over
  bool home = false;
};

/// One of the arms.
struct Side {
  Side(const RunLinks& links, const RunOptions& options, std::size_t number);
  Chooser chooser;
  robot::HandshakeOptions shake;
  const robot::Arm* arm;
  std::string gripper;  ///< that it has on
  Stop here;            ///< where it waits
  CycleReport picked;   ///< of what it holds: the line of its place tells of its grasp too
  const Entry* held(const JournalState& state) const;
  Chooser::Start start() const;
  /// The arm, without what never moves, the gripper and what it holds.
  std::vector<grasp::Convex> bodies(const JournalState& state) const;
};

class TwoArms {
 public:
  TwoArms(const RunLinks& links, const RunOptions& options);
  RunEnd go();

 private:
  // two_arms.cpp
  bool round();  ///< \return false at the end
  bool scan();   ///< \return whether picking may go on
  std::optional<Errand> choose(std::vector<int> free, const Errand* other);
  std::optional<Errand> push();
  bool regrasp();  ///< what stands at the station is taken by an arm while the other one waits
  bool station_is_free(const Errand* beside) const;
  bool nothing_to_pick();
  // errands.cpp
  std::optional<Errand> place_errand(int arm);
  std::optional<Errand> pick_errand(int arm, const Choice& choice);
  std::optional<Errand> push_errand(int arm, const grasp::Push& push);
  bool add_way(Errand& errand, Chooser::Start& at, const Pose& base_from_tcp, bool whole, const Entry* held);
  bool close_errand(Errand& errand, Chooser::Start at, const Entry* held);
  void carry_out(std::vector<Errand> errands);
  void begin(Errand& errand);
  void end(Errand& errand, robot::CycleResult result);
  // waist_and_recovery.cpp
  bool recover();
  bool ask_where(Side& side);
  bool bring_home(Side& side, const Side& other);
  void turn_waist();
  double waist_now();

  Side& side(int arm) { return sides_[static_cast<std::size_t>(arm) - 1]; }
  Side& other(int arm) { return sides_[static_cast<std::size_t>(2 - arm)]; }
  const JournalState& now() const { return links_.journal->state(); }
  std::vector<int> holding() const;
  bool finish(const std::string& status, const std::string& message);
  bool in_doubt(int arm, const std::string& what);
  void tell(CycleReport& report, const std::string& state, const std::string& note = {});

  const RunLinks& links_;
  const RunOptions& options_;
  std::vector<Side> sides_;
  Sight sight_;
  Resort resort_ = Resort::none;
  int scene_ = 0, pushes_ = 0, failures_ = 0;
  double scan_s_ = 0, waist_ = 0;
  std::string why_;
  std::string station_trouble_;  ///< why what stands at the station stays there; empty = it does not
  int turns_ = 0;                ///< at the station, of one part
  std::vector<std::pair<int, grasp::FailedPick>> failed_;  ///< with the scene
  RunEnd end_;
};

}  // namespace tribin::picking
