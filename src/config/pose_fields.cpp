#include "config/pose_fields.hpp"

#include <cmath>

#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin::config {
namespace {

using io::Fields;
using io::TomlPlace;

constexpr double kFarthest = 1e5;  // 100 m: beyond any cell, so that a mistaken unit is seen

struct Rotation {
  robot::Convention convention = robot::Convention::yaskawa;
  std::vector<double> values;
};

struct PoseKeys {
  Vec3 translation_mm = Vec3::Zero();
  Matrix3 rotation = Matrix3::Identity();
  double sigma_mm = 0, sigma_rad = 0;
};

robot::Convention read_convention(const TomlPlace& place) {
  std::string names;
  for (const robot::Convention c : robot::kConventions) names += (names.empty() ? "" : ", ") + std::string(name_of(c));
  const std::string name = place.text("one of " + names);
  for (const robot::Convention c : robot::kConventions)
    if (name == name_of(c)) return c;
  place.fail("one of " + names);
}

std::vector<double> read_values(const TomlPlace& place) {
  constexpr const char* kWanted = "3 numbers, or 4 of a quaternion";
  const std::size_t count = place.array_size(kWanted);
  if (count != 3 && count != 4) place.fail(kWanted);
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(place.at(i).number(-360, 360, "an angle or a number of a quaternion"));
  return out;
}

Fields<Rotation> rotation_fields() {
  Fields<Rotation> fields;
  fields.value("convention", "", "yaskawa, fanuc, kuka, mitsubishi, kawasaki, abb, ur, ros", "", &Rotation::convention,
               "whose numbers these are", read_convention);
  fields.required();
  fields.value("values", "deg", "3 numbers (4 for abb, ros)", "", &Rotation::values,
               "as that maker's pendant shows them; ur: a rotation vector in rad; abb: q1..q4; ros: x, y, z, w",
               read_values);
  return fields.required();
}

Matrix3 read_rotation(const TomlPlace& place) {
  const Rotation r = rotation_fields().read(place);
  const int count = rotation_numbers(r.convention);
  const std::string whose = " of " + std::string(name_of(r.convention));
  if (static_cast<int>(r.values.size()) != count) place.at("values").fail(std::to_string(count) + " numbers" + whose);
  double length = 0;
  for (const double v : r.values) length = std::hypot(length, v);
  if (count == 4 && length < 1e-3) place.at("values").fail("a quaternion" + whose + " that is not 0");
  // A rotation vector longer than a whole turn is one in degrees.
  if (r.convention == robot::Convention::ur && length > 2 * kPi)
    place.at("values").fail("a rotation vector in radians, no longer than 2 pi", ErrorCode::out_of_range);
  std::vector<double> numbers{0, 0, 0};
  numbers.insert(numbers.end(), r.values.begin(), r.values.end());
  return robot::pose_from_numbers(r.convention, numbers).linear();
}

Fields<PoseKeys> pose_fields() {
  Fields<PoseKeys> fields;
  fields.numbers("translation_mm", "mm", {-kFarthest, kFarthest}, &PoseKeys::translation_mm,
                 "position of the frame's origin");
  fields.value("rotation_deg", "", "table", kPoseFallback, &PoseKeys::rotation, "its rotation", read_rotation);
  return fields;
}

Pose pose_of(const PoseKeys& keys) {
  Pose pose = Pose::Identity();
  pose.linear() = keys.rotation;
  pose.translation() = keys.translation_mm;
  return pose;
}

}  // namespace

Pose read_pose(const TomlPlace& place) { return pose_of(pose_fields().read(place)); }

CellHandEye read_uncertain_pose(const TomlPlace& place) {
  Fields<PoseKeys> fields = pose_fields();
  fields.number("sigma_mm", "mm", {0, 1000}, &PoseKeys::sigma_mm, "");
  fields.number("sigma_deg", "deg", {0, 180}, &PoseKeys::sigma_rad, "", kDegree);
  const PoseKeys keys = fields.read(place);
  return {pose_of(keys), keys.sigma_mm, keys.sigma_rad};
}

std::vector<io::KeyRow> pose_rows() {
  std::vector<io::KeyRow> rows = pose_fields().rows();
  for (const io::KeyRow& row : rotation_fields().rows("rotation_deg.")) rows.push_back(row);
  rows.push_back({"sigma_mm", "mm", "0 .. 1000", "0", "hand-eye only: sd of the position; 0 = not said"});
  rows.push_back({"sigma_deg", "deg", "0 .. 180", "0", "hand-eye only: sd of the rotation; 0 = not said"});
  return rows;
}

}  // namespace tribin::config
