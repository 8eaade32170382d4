#pragma once

#include "picking/chooser.hpp"

namespace tribin::picking {

inline constexpr int kMostFailures = 10;  // grips in a row that held nothing: something else is wrong
inline constexpr Chooser::Where kAllPlaces[] = {Chooser::Where::slots, Chooser::Where::station, Chooser::Where::turned};

/// For people: what software refuses; the most frequent reasons of a plan.
std::string text_of(const std::vector<std::string>& texts);
std::string text_of(const std::vector<grasp::WhyCount>& reasons);

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
  Phase place();
  Phase regrasp();
  Phase push();

  // recover.cpp
  bool settle_open_order();
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
  void note_end(const Entry& order, robot::CycleResult result);
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
  std::optional<Chooser::Start> here_;  ///< where the arm was sent last
  RunEnd end_;
};

}  // namespace tribin::picking
