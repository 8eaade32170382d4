#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"
#include "tribin/picking/rack.hpp"

/// What was done with each part, on disk before it is done: a program that was killed at any point goes on at the right
/// slot, and places nothing twice.
namespace tribin::picking {

enum class Event {
  new_rack,       ///< an empty rack stands there
  pick_ordered,   ///< next: picked or missed
  picked,         ///< the part is in the hand
  measured,       ///< a scan in the hand shows how it is held
  missed,         ///< nothing was gripped
  place_ordered,  ///< next: placed or lost
  placed,
  lost,          ///< on the way: it is not in the hand and not in the slot
  move_ordered,  ///< way points, pushes and whatever else changes neither hand nor rack; next: moved
  moved,
  not_taken,      ///< the controller never had the order: nothing was done
  operator_said,  ///< what is in the hand and in the slot
};
std::string_view name_of(Event event);

/// One line of the journal.
struct Entry {
  Event event = Event::new_rack;
  int cycle = 0;  ///< number of the hand-shake; 0 = none
  int arm = 1;    ///< of two: each has a hand and cycles of its own
  int scene = 0;  ///< that the part was found in
  std::string part, gripper, grasp;
  int slot = 0;                            ///< of places: 0 = the station for gripping anew
  bool from_station = false;               ///< of picks
  Pose base_from_part = Pose::Identity();  ///< as it was measured
  Pose tcp_from_part = Pose::Identity();   ///< in the hand
  double opening_mm = 0;                   ///< of the jaws before they close, and when they let go
  double holds_mm = 0;                     ///< of the jaws where they hold
  double sigma_mm = 0;                     ///< sd of its place in the hand, with [in_hand]; 0 = not said
  std::string note;                        ///< for people
};

/// What the journal says about one arm.
struct HandState {
  std::optional<Entry> in_hand;  ///< the entry that tells of it
  std::optional<Entry> open;     ///< an order whose end is not known
  int last_cycle = 0;
  int last_taken = 0;  ///< the last cycle that the controller is known to have had; 0 = none
};

/// What the journal says about now: of the first arm, and of the second where there is one.
struct JournalState : HandState {
  HandState second;
  Filling filling;
  std::optional<Entry> at_station;  ///< put down to be gripped anew
  int last_scene = 0;
  int placed = 0;
  HandState& hand(int arm) { return arm == 2 ? second : *this; }
  const HandState& hand(int arm) const { return arm == 2 ? second : *this; }
};

/// Follows one entry. \throws Error bad_input where it cannot follow the state (a slot that the rack does not have or
/// that is full, a place without a part in the hand).
void follow(JournalState& state, const Entry& entry, const std::string& where);

/// The journal on disk: one JSON object a line, each on the disk (fsync) before `write` returns. One program at a time
/// has it. A last line that was torn by a crash is cut off: what it tells of was not begun yet, or is told by the
/// controller.
class Journal {
 public:
  /// Opens or makes it. \param slots  of the rack
  /// \throws Error bad_input naming the line (another rack's journal, a broken line), device (in use, disk full)
  Journal(std::filesystem::path file, std::size_t slots);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  const JournalState& state() const;
  const std::filesystem::path& file() const;
  /// \throws Error as follow, device where the disk does not take it
  void write(const Entry& entry);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The entries of a journal's text, without touching it. \throws Error bad_input
std::vector<Entry> entries_of(const std::string& text, const std::string& name);

}  // namespace tribin::picking
