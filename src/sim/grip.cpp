#include "sim/grip.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/solid.hpp"

namespace tribin::sim {
namespace {

constexpr double kGravity = 9.81;
// Points of the shell that are that near to the one touched first are touched as well: pads and parts give way so far.
constexpr double kSeat_mm = 0.3;
constexpr double kTight_mm = 1;   // what the lip of a cup follows
constexpr double kReach_mm = 3;   // how far a cup's bellows draw a part near, or are pressed in
constexpr double kCupSafety = 2;  // of a cup's force, for the acceleration of the arm

struct Contact {
  double at = 0;  ///< along the jaw's direction from the tool's axis
  Vec3 middle = Vec3::Zero();
  double across = 0;  ///< best cosine between the surface's normal and the jaw's direction
  bool any = false;
};

/// Where a jaw that comes along -direction (inside: along it) touches first, of what lies between the jaws (inside:
/// around them). \param direction  unit, from the axis to the jaw
Contact first_touch(const Solid::State& part, const Pose& tcp_from_part, const grasp::GripperShape& gripper,
                    double opening_mm, const Vec3& direction) {
  const Vec3 side = Vec3::UnitZ().cross(direction);
  const double sense =
      gripper.inside ? -1 : 1;  // an outer jaw meets the farthest point first, an inner one the nearest
  std::vector<std::pair<double, const Vec3f*>> met;
  double best = -1e30;
  for (const Vec3f& point : part.shell.points) {
    const Vec3 p = tcp_from_part * point.cast<double>();
    if (std::abs(p.dot(side)) > gripper.pad.width_mm / 2) continue;
    if (p.z() > gripper.pad.tip_mm || p.z() < gripper.pad.tip_mm - gripper.pad.length_mm) continue;
    const double s = p.dot(direction);
    if (gripper.inside ? s <= 0 : std::abs(s) > opening_mm / 2 + kSeat_mm) continue;
    met.push_back({sense * s, &point});
    best = std::max(best, sense * s);
  }
  Contact contact;
  int count = 0;
  for (const auto& [s, point] : met) {
    if (s < best - kSeat_mm) continue;
    Vec3f normal;
    part.field.at(*point, normal);
    const Vec3 n = tcp_from_part.linear() * normal.cast<double>();
    contact.across = std::max(contact.across, sense * n.dot(direction));
    contact.middle += tcp_from_part * point->cast<double>();
    ++count;
  }
  if (count == 0) return contact;
  contact.any = true;
  contact.middle /= count;
  contact.at = sense * best;
  return contact;
}

Grip close_jaws(const grasp::GripperShape& gripper, double opening_mm, const Solid::State& part,
                const Pose& tcp_from_part, double friction, double mass_kg) {
  const int jaws = gripper.jaws;
  std::vector<Vec3> directions;
  std::vector<Contact> contacts;
  Grip grip;
  for (int k = 0; k < jaws; ++k) {
    const double angle = 2 * kPi * k / jaws;
    directions.push_back(Vec3(std::cos(angle), std::sin(angle), 0));
    contacts.push_back(first_touch(part, tcp_from_part, gripper, opening_mm, directions.back()));
    grip.touches = grip.touches || contacts.back().any;
  }
  const auto refuse = [&grip](const char* why) {
    grip.why = why;
    return grip;
  };
  for (const Contact& contact : contacts)
    if (!contact.any) return refuse("a jaw meets nothing");
  // Jaws move by the same way: the part is shifted until it is as far from the axis at each.
  double mean = 0;
  for (const Contact& contact : contacts) mean += contact.at / jaws;
  const double share = jaws == 2 ? 0.5 : 2.0 / jaws;  // least squares over the directions
  for (int k = 0; k < jaws; ++k) grip.shift_mm += share * (mean - contacts[k].at) * directions[k];
  grip.opening_mm = 2 * mean;
  if (!gripper.inside && grip.opening_mm > opening_mm) return refuse("the part is wider than the jaws stand open");
  if (gripper.inside && grip.opening_mm < opening_mm) return refuse("the hole is narrower than the jaws");
  if (grip.opening_mm < gripper.stroke_min() || grip.opening_mm > gripper.stroke_max())
    return refuse("the part's width is outside of the stroke");
  const double cone = std::cos(std::atan(friction));
  for (const Contact& contact : contacts)
    if (contact.across < cone) return refuse("the surface slants: it slips out of the jaws");
  if (jaws == 2) {
    const Vec3 line = (contacts[0].middle - contacts[1].middle).normalized();
    if (std::abs(line.x()) < cone) return refuse("the contacts are not opposite each other: it turns out of the jaws");
  }
  if (gripper.gripper.force_n > 0 && jaws * friction * gripper.gripper.force_n < mass_kg * kGravity)
    return refuse("the force does not carry the part");
  grip.holds = true;
  return grip;
}

/// Way along +z from a point to the part; none within the reach.
double gap_along_z(const Solid::State& part, const Pose& part_from_tcp, const Vec3& from) {
  const Vec3 step = part_from_tcp.linear() * Vec3::UnitZ();
  Vec3 p = part_from_tcp * Vec3(from - kReach_mm * Vec3::UnitZ());
  for (double way = -kReach_mm; way <= kReach_mm;) {
    const double d = part.field.at(p.cast<float>());
    if (d < 0.05) return way;
    way += std::max(0.05, 0.7 * d);
    p = part_from_tcp * from + way * step;
  }
  return 1e30;
}

Grip close_cup(const grasp::GripperShape& gripper, const Solid::State& part, const Pose& tcp_from_part,
               double mass_kg) {
  const Pose part_from_tcp = tcp_from_part.inverse();
  constexpr int kRim = 24;
  double low = 1e30, high = -1e30;
  Grip grip;
  for (int k = 0; k < kRim; ++k) {
    const double angle = 2 * kPi * k / kRim;
    const double gap = gap_along_z(part, part_from_tcp, gripper.cup_mm * Vec3(std::cos(angle), std::sin(angle), 0));
    low = std::min(low, gap), high = std::max(high, gap);
  }
  grip.touches = low < kReach_mm;
  if (high > kReach_mm) {
    grip.why = "a part of the rim meets nothing";
  } else if (high - low > kTight_mm) {
    grip.why = "the surface under the rim is not flat";
  } else if (gripper.gripper.force_n > 0 && gripper.gripper.force_n < kCupSafety * mass_kg * kGravity) {
    grip.why = "the force does not carry the part";
  } else {
    grip.holds = true;
    grip.shift_mm.z() = -(low + high) / 2;
  }
  return grip;
}

}  // namespace

Grip close_gripper(const grasp::GripperShape& gripper, double opening_mm, const Solid& part, const Pose& tcp_from_part,
                   double friction, double mass_kg) {
  return gripper.jaws > 0 ? close_jaws(gripper, opening_mm, part.state(), tcp_from_part, friction, mass_kg)
                          : close_cup(gripper, part.state(), tcp_from_part, mass_kg);
}

}  // namespace tribin::sim
