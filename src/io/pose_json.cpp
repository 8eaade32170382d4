#include "io/pose_json.hpp"

#include <cmath>

namespace tribin::io {
namespace {

Vec3 point_at(const JsonPlace& object, const char* key) {
  constexpr const char* kWanted = "3 numbers [mm]";
  const std::vector<double> t = object.at(key, kWanted).numbers(3, kWanted);
  return {t[0], t[1], t[2]};
}

/// Printed digits leave a matrix a little off; more than 1e-3 is no rotation but another thing (a transposed shear,
/// mm).
Matrix3 rotation_matrix(const JsonPlace& place) {
  constexpr const char* kWanted = "3 rows of 3 numbers, a rotation matrix";
  Matrix3 r;
  if (place.array_size(kWanted) != 3) place.fail(kWanted);
  for (int row = 0; row < 3; ++row) {
    const std::vector<double> numbers = place.at(static_cast<std::size_t>(row)).numbers(3, kWanted);
    r.row(row) << numbers[0], numbers[1], numbers[2];
  }
  if (!((r * r.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff() < 1e-3) || r.determinant() < 0)
    place.fail("a rotation matrix: rows of length 1 at right angles, right-handed");
  return Eigen::Quaterniond(Eigen::Matrix3d(r)).normalized().toRotationMatrix();
}

}  // namespace

Pose pose_of(const JsonPlace& entry) {
  Pose pose = Pose::Identity();
  pose.translation() = point_at(entry, "translation_mm");
  if (entry.has("rotation_vector_rad")) {
    constexpr const char* kWanted = "3 numbers [rad]";
    const std::vector<double> w = entry.at("rotation_vector_rad", kWanted).numbers(3, kWanted);
    pose.linear() = rotation_from_vector({w[0], w[1], w[2]});
  } else {
    pose.linear() = rotation_matrix(entry.at("rotation", "\"rotation\" (3 x 3) or \"rotation_vector_rad\""));
  }
  return pose;
}

nlohmann::ordered_json json_of(const Pose& pose) {
  const Matrix3 r = pose.linear();
  const Vec3 t = pose.translation();
  nlohmann::ordered_json out;
  for (int row = 0; row < 3; ++row) out["rotation"].push_back({r(row, 0), r(row, 1), r(row, 2)});
  out["translation_mm"] = {t.x(), t.y(), t.z()};
  return out;
}

robot::Convention convention_of(const JsonPlace& place) {
  std::string names;
  for (robot::Convention c : robot::kConventions) {
    if (place.value() == std::string(robot::name_of(c))) return c;
    names += (names.empty() ? "" : ", ") + std::string(robot::name_of(c));
  }
  place.fail("one of " + names);
}

Pose robot_pose_of(const JsonPlace& place, robot::Convention convention) {
  const int turns = robot::rotation_numbers(convention);
  const std::vector<double> numbers =
      place.numbers(3 + turns, std::to_string(3 + turns) + " numbers: x, y, z, then the " + std::to_string(turns) +
                                   " of its rotation (" + std::string(robot::name_of(convention)) + ")");
  if (turns == 4) {
    const double norm = std::hypot(std::hypot(numbers[3], numbers[4]), std::hypot(numbers[5], numbers[6]));
    if (!(std::abs(norm - 1) < 1e-2)) place.fail("a quaternion of length 1");  // two printed digits
  }
  if (convention == robot::Convention::ur &&
      !(std::hypot(numbers[3], numbers[4], numbers[5]) <= 4 * kPi))  // the controller keeps it below 2 pi
    place.fail("a rotation vector in radians");
  return robot::pose_from_numbers(convention, numbers);
}

}  // namespace tribin::io
