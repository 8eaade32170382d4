#include "tribin/config/work_cell.hpp"

#include <algorithm>

#include "config/cell_fields.hpp"
#include "config/pose_fields.hpp"

namespace tribin {
namespace {

using config::HandEyeKeys;
using io::Fields;
using io::TomlPlace;

/// The sections as they stand in the file.
struct Sections {
  std::optional<CellCamera> camera;
  HandEyeKeys hand_eye;
  std::optional<CellBin> bin;
  std::vector<Gripper> grippers;
  std::vector<CellPart> parts;
  std::optional<Rack> rack;
  std::optional<Regrasp> regrasp;
  std::optional<InHand> in_hand;
  std::vector<CellRobot> robots;
  Safety safety;
};

/// Places of a list's entries that have equal names, or a name that no entry of `known` has.
template <class Named>
void must_know(const TomlPlace& place, const std::string& name, const std::vector<Named>& known) {
  std::string names;
  for (const Named& entry : known) {
    if (entry.name == name) return;
    names += (names.empty() ? "" : ", ") + entry.name;
  }
  place.fail(names.empty() ? "a name that the file has; it has none" : "one of " + names);
}

template <class Named>
void must_differ(const TomlPlace& list, const std::vector<Named>& entries) {
  for (std::size_t i = 0; i < entries.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (entries[i].name == entries[j].name) list.at(i).at("name").fail("a name of its own");
}

/// Names lead somewhere, and no two of a kind are equal.
void check_names(const TomlPlace& top, const Sections& s) {
  if (!s.grippers.empty()) must_differ(top.at("gripper"), s.grippers);
  if (!s.parts.empty()) must_differ(top.at("part"), s.parts);
  for (std::size_t i = 0; i < s.parts.size(); ++i) {
    const TomlPlace part = top.at("part").at(i);
    for (std::size_t k = 0; k < s.parts[i].grippers.size(); ++k)
      must_know(part.at("grippers").at(k), s.parts[i].grippers[k], s.grippers);
    for (std::size_t k = 0; k < s.parts[i].pick_points.size(); ++k)
      if (!s.parts[i].pick_points[k].gripper.empty())
        must_know(part.at("pick_points").at(k).at("gripper"), s.parts[i].pick_points[k].gripper, s.grippers);
  }
  for (std::size_t i = 0; i < s.robots.size(); ++i)
    for (std::size_t k = 0; k < s.robots[i].grippers.size(); ++k)
      must_know(top.at("robot").at(i).at("grippers").at(k), s.robots[i].grippers[k], s.grippers);
}

/// What is odd but no error: a sequence may name a part that the cell does not have yet.
std::vector<std::string> warnings_of(const Sections& s) {
  std::vector<std::string> out;
  if (!s.rack) return out;
  const auto note = [&](const std::string& place, const std::vector<std::string>& names) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto has_name = [&](const CellPart& part) { return part.name == names[k]; };
      if (std::none_of(s.parts.begin(), s.parts.end(), has_name))
        out.push_back(place + "[" + std::to_string(k) + "]: there is no part " + io::in_quotes(names[k]));
    }
  };
  note("rack.sequence", s.rack->sequence);
  for (std::size_t i = 0; i < s.rack->given.size(); ++i)
    note("rack.slot[" + std::to_string(i) + "].parts", s.rack->given[i].parts);
  return out;
}

/// Only a fixed camera sees what the arm holds before it.
void check_in_hand(const TomlPlace& top, const Sections& s) {
  if (!s.in_hand) return;
  if (s.camera && s.camera->mount == CameraMount::hand)
    top.at("in_hand").fail("no [in_hand], as the camera's mount is \"hand\"");
  if (s.robots.size() > 1) top.at("in_hand").fail("no [in_hand], as there are two arms");
}

/// The pose must be the one that the mount has: the other would be believed in the wrong frame.
void check_hand_eye(const TomlPlace& top, const Sections& s) {
  const bool hand = s.camera && s.camera->mount == CameraMount::hand;
  const char* wrong = hand ? "base_from_camera" : "flange_from_camera";
  if (hand ? s.hand_eye.base_from_camera.has_value() : s.hand_eye.flange_from_camera.has_value())
    top.at("hand_eye")
        .at(wrong)
        .fail(hand ? "flange_from_camera, as the camera's mount is \"hand\""
                   : "base_from_camera, as the camera's mount is \"fixed\"");
}

Fields<Sections> sections() {
  Fields<Sections> fields;
  fields.table("camera", config::camera_fields(), &Sections::camera, "which camera, and where it sits");
  fields.table("hand_eye", config::hand_eye_fields(), &Sections::hand_eye, "where it stands");
  fields.table("bin", config::bin_fields(), &Sections::bin, "the bin that parts lie in");
  fields.list("gripper", config::gripper_fields(), &Sections::grippers, "`[[gripper]]`, one a tool");
  fields.list("part", config::part_fields(), &Sections::parts, "`[[part]]`, one a CAD file");
  fields.table("rack", config::rack_fields(), &Sections::rack, "where parts are put");
  fields.table("regrasp", config::regrasp_fields(), &Sections::regrasp, "where parts are gripped anew");
  fields.table("in_hand", config::in_hand_fields(), &Sections::in_hand, "where a part in the hand is measured");
  fields.list("robot", config::robot_fields(), &Sections::robots, "`[[robot]]`, one an arm");
  fields.table("safety", config::safety_fields(), &Sections::safety, "what motion is refused for");
  return fields.check(check_names).check(check_hand_eye).check(check_in_hand);
}

WorkCell read_cell(const std::filesystem::path& path, const char* wanted) {
  const io::FileBytes file = io::read_file(path);
  const toml::table document = io::parse_toml(file);
  const TomlPlace top(file.name, document, "");
  Sections s = sections().read(top);
  if (!top.has(wanted)) top.fail_missing("[" + std::string(wanted) + "]");
  const auto& hand_eye = s.hand_eye.base_from_camera ? s.hand_eye.base_from_camera : s.hand_eye.flange_from_camera;
  std::vector<std::string> warnings = warnings_of(s);
  return {path,
          std::move(s.camera),
          hand_eye.value_or(CellHandEye{}),
          std::move(s.bin),
          std::move(s.grippers),
          std::move(s.parts),
          std::move(s.rack),
          std::move(s.regrasp),
          std::move(s.in_hand),
          std::move(s.robots),
          std::move(s.safety),
          std::move(warnings)};
}

}  // namespace

WorkCell read_work_cell(const std::filesystem::path& path) { return read_cell(path, "camera"); }

WorkCell read_bin(const std::filesystem::path& path) { return read_cell(path, "bin"); }

std::string work_cell_keys() {
  return io::markdown_of(sections().rows()) + "\nA pose:\n\n" + io::markdown_of(config::pose_rows());
}

}  // namespace tribin
