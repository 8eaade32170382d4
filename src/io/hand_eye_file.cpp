#include "tribin/io/hand_eye_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "io/pose_json.hpp"
#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin {
namespace {

using io::JsonPlace;

/// Ids are texts or whole numbers: 7 and "7" are one.
std::string id_of(const JsonPlace& entry) {
  const JsonPlace id = entry.at("id", "an id, by which robot and camera poses are paired");
  if (id.value().is_number_integer()) return id.value().dump();
  const std::string text = id.value().is_string() ? id.value().get<std::string>() : "";
  if (text.empty()) id.fail("a text or a whole number");
  return text;
}

Vec3 point_at(const JsonPlace& entry, const char* key) {
  constexpr const char* kWanted = "3 numbers [mm]";
  const std::vector<double> t = entry.at(key, kWanted).numbers(3, kWanted);
  return {t[0], t[1], t[2]};
}

struct RobotFormat {
  std::optional<robot::Convention> convention;
  double unit = 1;  ///< of positions, over the convention's own
};

RobotFormat robot_format(const JsonPlace& top) {
  RobotFormat out;
  if (top.has("convention")) {
    out.convention = io::convention_of(top.at("convention", ""));
  }
  if (top.has("robot_unit")) {
    const JsonPlace place = top.at("robot_unit", "");
    if (place.value() != "mm" && place.value() != "m") place.fail("\"mm\" or \"m\"");
    out.unit = place.value() == "m" ? 1000 : 1;
    if (out.convention) out.unit /= robot::position_unit_mm(*out.convention);
  }
  return out;
}

Pose robot_pose(const JsonPlace& entry, const RobotFormat& format) {
  entry.only_keys({"id", "pose", "rotation", "rotation_vector_rad", "translation_mm"});
  if (!entry.has("pose")) return io::pose_of(entry);
  if (!format.convention)
    entry.at("pose", "").fail("\"convention\" at the top level, which says what these numbers mean");
  Pose pose = io::robot_pose_of(entry.at("pose", ""), *format.convention);
  pose.translation() *= format.unit;
  return pose;
}

Pose camera_pose(const JsonPlace& entry, HandEyeTarget target) {
  entry.only_keys({"id", "rotation", "rotation_vector_rad", "translation_mm", "center_mm"});
  if (target == HandEyeTarget::board) return io::pose_of(entry);
  Pose pose = Pose::Identity();
  pose.translation() = point_at(entry, "center_mm");
  return pose;
}

struct Named {
  std::string id;
  Pose pose;
};

template <class Read>
std::vector<Named> named_poses(const JsonPlace& top, const char* key, const Read& read) {
  const std::string wanted = std::string("a list \"") + key + "\" of poses";
  const JsonPlace list = top.at(key, wanted);
  std::vector<Named> out;
  std::map<std::string, std::size_t> seen;
  for (std::size_t i = 0; i < list.array_size(wanted); ++i) {
    const JsonPlace entry = list.at(i);
    entry.must_be_object("an object with \"id\" and a pose");
    out.push_back({id_of(entry), read(entry)});
    const auto [first, fresh] = seen.emplace(out.back().id, i);
    if (!fresh)
      entry.at("id", "").fail("an id of its own: " + list.at(first->second).value().at("id").dump() +
                              " is also that of entry " + std::to_string(first->second));
  }
  return out;
}

HandEyeNoise noise_of(const JsonPlace& top) {
  HandEyeNoise noise;
  if (!top.has("noise")) return noise;
  const JsonPlace place = top.at("noise", "");
  place.must_be_object("{\"robot_mm\", \"robot_deg\", \"camera_mm\", \"camera_deg\"}");
  place.only_keys({"robot_mm", "robot_deg", "camera_mm", "camera_deg"});
  struct Field {
    const char* key;
    double* value;
    double unit;
  };
  for (const Field& f : {Field{"robot_mm", &noise.robot_mm, 1},
                         {"robot_deg", &noise.robot_rad, kDegree},
                         {"camera_mm", &noise.camera_mm, 1},
                         {"camera_deg", &noise.camera_rad, kDegree}}) {
    if (!place.has(f.key)) continue;
    const JsonPlace number = place.at(f.key, "");
    if (!number.value().is_number() || !(number.value().get<double>() > 0)) number.fail("a number > 0");
    *f.value = number.value().get<double>() * f.unit;
  }
  return noise;
}

/// An arm that works within 10 mm of its own base is an arm whose poses are in metres; none reaches 100 m.
void check_unit(const std::string& file, const char* key, const char* cure, const std::vector<Named>& poses) {
  double farthest = 0;
  for (const Named& named : poses) farthest = std::max(farthest, named.pose.translation().norm());
  if (poses.empty() || (farthest > 10 && farthest < 1e5)) return;
  char seen[80];
  std::snprintf(seen, sizeof seen, "positions of at most %.4g mm", farthest);
  io::bad_file(file, key, seen, std::string("between 10 mm and 100 m; for metres ") + cure, ErrorCode::out_of_range);
}

}  // namespace

HandEyeFile read_hand_eye_file(const std::filesystem::path& path) {
  const io::FileBytes file = io::read_file(path);
  const nlohmann::json document = io::parse_json(file, "robot and camera poses (JSON)");
  const JsonPlace top(file.name, document, JsonPlace::kTop);
  top.must_be_object("a JSON object with \"robot\" and \"camera\" poses");
  top.only_keys({"mount", "target", "convention", "robot_unit", "noise", "robot", "camera", "comment"});
  HandEyeFile out;
  if (top.has("mount")) {
    const JsonPlace mount = top.at("mount", "");
    if (mount.value() != "fixed" && mount.value() != "hand") mount.fail("\"fixed\" or \"hand\"");
    out.mount = mount.value() == "fixed" ? CameraMount::fixed : CameraMount::hand;
  }
  if (top.has("target")) {
    const JsonPlace target = top.at("target", "");
    if (target.value() != "board" && target.value() != "sphere") target.fail("\"board\" or \"sphere\"");
    out.target = target.value() == "board" ? HandEyeTarget::board : HandEyeTarget::sphere;
  }
  out.noise = noise_of(top);
  const RobotFormat format = robot_format(top);
  const std::vector<Named> robots =
      named_poses(top, "robot", [&](const JsonPlace& entry) { return robot_pose(entry, format); });
  const std::vector<Named> cameras =
      named_poses(top, "camera", [&](const JsonPlace& entry) { return camera_pose(entry, out.target); });
  check_unit(file.name, "robot", "give \"robot_unit\": \"m\"", robots);
  check_unit(file.name, "camera", "multiply by 1000", cameras);

  std::map<std::string, const Pose*> by_id;
  for (const Named& camera : cameras) by_id[camera.id] = &camera.pose;
  for (const Named& named : robots) {
    const auto found = by_id.find(named.id);
    if (found == by_id.end()) {
      out.robot_only.push_back(named.id);
      continue;
    }
    out.pairs.push_back({named.id, named.pose, *found->second});
    by_id.erase(found);
  }
  for (const Named& camera : cameras)
    if (by_id.contains(camera.id)) out.camera_only.push_back(camera.id);
  return out;
}

TouchFile read_touch_file(const std::filesystem::path& path) {
  const io::FileBytes file = io::read_file(path);
  const nlohmann::json document = io::parse_json(file, "predicted and touched points (JSON)");
  const JsonPlace top(file.name, document, JsonPlace::kTop);
  top.must_be_object("a JSON object with \"points\"");
  top.only_keys({"date", "points", "comment"});
  TouchFile out;
  if (top.has("date")) {
    out.date = top.at("date", "").text("a day, YYYY-MM-DD");
    if (!is_date(*out.date)) top.at("date", "").fail("a day, YYYY-MM-DD");
  }
  constexpr const char* kWanted = "a list \"points\" of {\"id\", \"predicted_mm\", \"touched_mm\"}";
  const JsonPlace list = top.at("points", kWanted);
  std::map<std::string, std::size_t> seen;
  for (std::size_t i = 0; i < list.array_size(kWanted); ++i) {
    const JsonPlace entry = list.at(i);
    entry.must_be_object("{\"id\", \"predicted_mm\", \"touched_mm\"}");
    entry.only_keys({"id", "predicted_mm", "touched_mm"});
    out.points.push_back({id_of(entry), point_at(entry, "predicted_mm"), point_at(entry, "touched_mm")});
    const auto [first, fresh] = seen.emplace(out.points.back().id, i);
    if (!fresh) entry.at("id", "").fail("an id of its own: entry " + std::to_string(first->second) + " has it too");
  }
  return out;
}

bool is_date(const std::string& text) {
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') return false;
  for (int i : {0, 1, 2, 3, 5, 6, 8, 9})
    if (text[i] < '0' || text[i] > '9') return false;
  const int year = std::stoi(text), month = std::stoi(text.substr(5)), day = std::stoi(text.substr(8));
  constexpr int kDays[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const bool leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
  return month >= 1 && month <= 12 && day >= 1 && day <= kDays[month - 1] + (month == 2 && leap);
}

}  // namespace tribin
