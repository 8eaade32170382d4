#include "tribin/picking/rack.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

constexpr double kSigmas = 3;  // one place in 400 is farther off

void set_part(Slot& slot, const Rack& rack) {
  if (slot.parts.empty() && !rack.sequence.empty())
    slot.parts = {rack.sequence[static_cast<std::size_t>(slot.number - 1) % rack.sequence.size()]};
}

}  // namespace

std::vector<Slot> slots_of(const Rack& rack) {
  std::vector<Slot> slots;
  if (!rack.given.empty()) {
    for (const GivenSlot& given : rack.given) {
      slots.push_back({static_cast<int>(slots.size()) + 1, rack.base_from_rack * given.rack_from_slot, given.parts, 0});
      set_part(slots.back(), rack);
    }
    return slots;
  }
  const RackSlots& grid = rack.slots;
  for (int layer = 0; layer < grid.layers; ++layer)
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) {
        Pose rack_from_slot = Pose::Identity();
        rack_from_slot.translation() = Vec3(column, row, layer).cwiseProduct(grid.pitch_mm);
        if (row % 2 == 1) rack_from_slot.translation().x() += grid.stagger_mm;
        slots.push_back({static_cast<int>(slots.size()) + 1, rack.base_from_rack * rack_from_slot, {}, layer});
        set_part(slots.back(), rack);
      }
  return slots;
}

std::vector<Pose> station_poses(const WorkCell& cell, const CellPart& part) {
  if (!cell.regrasp) return {};
  std::vector<Pose> poses{cell.regrasp->base_from_station * part.slot_from_part};
  for (const Pose& pose : part.station_from_part) poses.push_back(cell.regrasp->base_from_station * pose);
  return poses;
}

bool may_stand(const Slot& slot, const std::string& part) {
  return slot.parts.empty() || std::find(slot.parts.begin(), slot.parts.end(), part) != slot.parts.end();
}

std::string name_of(const Slot& slot) {
  std::string names;
  for (const std::string& part : slot.parts) names += (names.empty() ? "" : ", ") + part;
  return "slot " + std::to_string(slot.number) + (names.empty() ? "" : " (" + names + ")");
}

std::vector<const Slot*> open_slots(std::span<const Slot> slots, const Filling& filling, WhenMissing when_missing) {
  TRIBIN_ASSERT(filling.size() == slots.size());
  std::vector<const Slot*> open;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (!filling[i].empty()) continue;
    if (!open.empty() && (slots[i].layer != open.front()->layer || when_missing == WhenMissing::wait)) break;
    open.push_back(&slots[i]);
  }
  return open;
}

double PlaceError::total() const { return std::sqrt(pose * pose + hand_eye * hand_eye + robot * robot + grip * grip); }

std::optional<std::string> too_tight(const Slot& slot, const PlaceError& error, double chamfer_mm) {
  if (chamfer_mm <= 0 || kSigmas * error.total() <= chamfer_mm) return {};
  char text[240];
  std::snprintf(
      text, sizeof text,
      ": saw a chamfer of %.2f mm, wanted at least %.2f mm, three times the place error of %.2f mm (pose %.2f, "
      "hand-eye %.2f, robot %.2f, grip %.2f)",
      chamfer_mm, kSigmas * error.total(), error.total(), error.pose, error.hand_eye, error.robot, error.grip);
  return name_of(slot) + text;
}

}  // namespace tribin::picking
