#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tribin/config/work_cell.hpp"

/// The rack as slots: where each one is, what may stand in it, which one is next.
namespace tribin::picking {

/// A place for one part.
struct Slot {
  int number = 0;  ///< from 1, in the order of filling
  Pose base_from_slot = Pose::Identity();
  std::vector<std::string> parts;  ///< that may stand in it; empty = any
  int layer = 0;                   ///< from 0; a layer is begun when the one below is full
};

/// The slots of a rack, in the order of filling: by columns, rows, layers. The sequence gives each slot its part, and
/// begins anew where it ends.
std::vector<Slot> slots_of(const Rack& rack);

/// Where a part may stand at the station: first as in a slot, then in the other ways. Empty without a station.
std::vector<Pose> station_poses(const WorkCell& cell, const CellPart& part);

bool may_stand(const Slot& slot, const std::string& part);

/// "slot 7 (alternator_a)": for people.
std::string name_of(const Slot& slot);

/// What stands in the rack. Index = slot number - 1; empty text = nothing.
using Filling = std::vector<std::string>;

/// The slots that may be filled now, in order, those of the lowest layer that is not full.
/// \param when_missing  wait: the next open slot alone
std::vector<const Slot*> open_slots(std::span<const Slot> slots, const Filling& filling, WhenMissing when_missing);

/// How far a part is placed from where it should be [mm], one standard deviation: the root of the sum of squares.
struct PlaceError {
  double pose = 0, hand_eye = 0, robot = 0, grip = 0;
  double total() const;
};

/// What a part's slot must forgive: three standard deviations. \return none where the chamfer holds it, or where the
/// rack says none; else the sentence that refuses it.
std::optional<std::string> too_tight(const Slot& slot, const PlaceError& error, double chamfer_mm);

}  // namespace tribin::picking
