#include "sim/grip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "sim/solid.hpp"

namespace tribin::sim {
namespace {

constexpr double kGravity = 9.81;
// Points of the shell that are that near to the one touched first are touched as well: pads and parts give way so far.
constexpr double kSeat_mm = 0.3;
constexpr double kInJaw_mm = 5;   // less than any jaw is thick
constexpr double kTight_mm = 1;   // what the lip of a cup follows
constexpr double kReach_mm = 3;   // how far a cup's bellows draw a part near, or are pressed in
constexpr double kCupSafety = 2;  // of a cup's force, for the acceleration of the arm

/// A point that is touched, frame of the TCP.
struct Touch {
  Vec3 at;
  Vec3 normal;  ///< of the contact, unit; the jaw's own direction where its flat meets the part
};

struct Contact {
  double at = 0;  ///< along the jaw's direction from the tool's axis
  std::vector<Touch> touches;
  bool any = false;
  bool through = false;  ///< the part goes on where the jaw is
};

constexpr double kSpacing_mm = 1;              // of points on what is touched: on a round of 20 mm they miss 0.01 mm
constexpr double kRim_mm = 1.5 * kSpacing_mm;  // what lies that near to the rim of a pad may be met by it
constexpr double kTurns_mm = 20;               // how far a part that the jaws align may come between the pads

/// A point of a part's surface, part frame.
struct SurfacePoint {
  Vec3f at, normal;
};

/// Rows of points over a triangle, along its longest side.
void add_rows(std::array<Vec3, 3> corners, std::vector<SurfacePoint>& out) {
  const Vec3 cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  if (cross.norm() <= 0) return;
  const auto side = [&](int k) { return (corners[(k + 1) % 3] - corners[k]).norm(); };
  const int longest = side(0) >= side(1) && side(0) >= side(2) ? 0 : side(1) >= side(2) ? 1 : 2;
  std::rotate(corners.begin(), corners.begin() + longest, corners.end());
  const int rows = static_cast<int>(std::ceil(cross.norm() / side(0) / kSpacing_mm));
  const Vec3f normal = cross.normalized().cast<float>();
  for (int row = 0; row <= rows; ++row) {
    const double up = static_cast<double>(row) / rows;
    const Vec3 from = corners[0] + up * (corners[2] - corners[0]), to = corners[1] + up * (corners[2] - corners[1]);
    const int steps = static_cast<int>(std::ceil((to - from).norm() / kSpacing_mm));
    for (int i = 0; i <= steps; ++i)
      out.push_back({(from + (to - from) * (static_cast<double>(i) / std::max(1, steps))).cast<float>(), normal});
  }
}

/// All of the part that the pads could come near.
std::vector<SurfacePoint> near_pads(const Mesh& mesh, const Pose& tcp_from_part, const grasp::GripperShape& gripper) {
  const double round = gripper.stroke_max() / 2 + kInJaw_mm, wide = gripper.pad.width_mm / 2 + kTurns_mm;
  const Vec3 high(round, gripper.jaws == 2 ? wide : round, gripper.pad.tip_mm + kTurns_mm);
  const Vec3 low(-high.x(), -high.y(), gripper.pad.tip_mm - gripper.pad.length_mm - kTurns_mm);
  std::vector<SurfacePoint> out;
  for (const auto& triangle : mesh.triangles) {
    std::array<Vec3, 3> corners;
    Vec3 least = Vec3::Constant(1e30), most = Vec3::Constant(-1e30);
    for (int k = 0; k < 3; ++k) {
      corners[k] = mesh.vertices[triangle[k]].cast<double>();
      const Vec3 p = tcp_from_part * corners[k];
      least = least.cwiseMin(p), most = most.cwiseMax(p);
    }
    if ((least.array() < high.array()).all() && (most.array() > low.array()).all()) add_rows(corners, out);
  }
  return out;
}

/// The flat of a pad, seen along the way of its jaw.
struct Flat {
  const grasp::Pad& pad;
  Vec3 side;  ///< along its width, unit

  /// How far a point lies within its rim [mm]; negative outside.
  double within(const Vec3& p) const {
    return std::min(pad.width_mm / 2 - std::abs(p.dot(side)),
                    std::min(pad.tip_mm - p.z(), p.z() - pad.tip_mm + pad.length_mm));
  }
};

/// Normal of what the rim of a pad meets at a point. Where the part does not rise beyond the rim, the point is the
/// highest one around, and the flat of the pad meets it, edge or face; where it does rise, the rim meets the face that
/// rises.
/// \param beyond  points outside the rim that are higher, as (place, height)
Vec3 rim_normal(const Touch& touch, double height, const std::vector<std::pair<Vec3, double>>& beyond, double near_mm,
                const Vec3& direction) {
  Vec3 up_hill = Vec3::Zero();  // the steepest way, by its rise for each mm
  for (const auto& [q, higher] : beyond) {
    const Vec3 way = q - touch.at;
    const Vec3 flat = way - way.dot(direction) * direction;
    const double rise = (higher - height) / std::max(flat.norm(), 1e-3);
    if (flat.norm() < near_mm && rise > up_hill.norm()) up_hill = rise * flat.normalized();
  }
  const Vec3 of_rise = (direction - up_hill).normalized();
  return touch.normal.dot(direction) > of_rise.dot(direction) ? touch.normal : of_rise;
}

/// Where a jaw that comes along -direction (inside: along it) touches first, of what lies between the jaws (inside:
/// around them). \param direction  unit, from the axis to the jaw
Contact first_touch(const std::vector<SurfacePoint>& part, const Pose& tcp_from_part,
                    const grasp::GripperShape& gripper, double opening_mm, const Vec3& direction) {
  const Flat flat{gripper.pad, Vec3::UnitZ().cross(direction)};
  // An outer jaw meets the farthest point first, an inner one the nearest.
  const double sense = gripper.inside ? -1 : 1;
  Contact contact;
  std::vector<std::pair<double, const SurfacePoint*>> met;
  std::vector<std::pair<Vec3, double>> outside;
  double best = -1e30;
  for (const SurfacePoint& point : part) {
    const Vec3 p = tcp_from_part * point.at.cast<double>();
    const double within = flat.within(p);
    if (within < -kRim_mm) continue;
    const double s = p.dot(direction);
    if (within < 0) {
      if (s > 0) outside.push_back({p, sense * s});
      continue;
    }
    const double beyond = s - opening_mm / 2;
    contact.through = contact.through || (!gripper.inside && beyond > kSeat_mm && beyond < kInJaw_mm);
    if (gripper.inside ? s <= 0 : std::abs(s) > opening_mm / 2 + kSeat_mm) continue;
    met.push_back({sense * s, &point});
    best = std::max(best, sense * s);
  }
  std::erase_if(outside, [best](const auto& point) { return point.second < best; });
  for (const auto& [s, point] : met) {
    if (s < best - kSeat_mm) continue;
    Touch touch{tcp_from_part * point->at.cast<double>(), direction};
    if (flat.within(touch.at) <= kRim_mm) {  // farther in, the flat meets it whatever the part is like there
      touch.normal = sense * (tcp_from_part.linear() * point->normal.cast<double>());
      touch.normal = rim_normal(touch, s, outside, kRim_mm, direction);
    }
    contact.touches.push_back(touch);
  }
  if (contact.touches.empty()) return contact;
  contact.any = true;
  contact.at = sense * best;
  return contact;
}

/// What the jaws meet, and how far they stand open then.
struct Closed {
  std::vector<Vec3> directions;
  std::vector<Contact> contacts;
  double mean = 0;  ///< of their ways from the axis
  bool all = true, any = false;
};
Closed close_on(const grasp::GripperShape& gripper, double opening_mm, const std::vector<SurfacePoint>& part,
                const Pose& tcp_from_part) {
  Closed closed;
  for (int k = 0; k < gripper.jaws; ++k) {
    const double angle = 2 * kPi * k / gripper.jaws;
    closed.directions.push_back(Vec3(std::cos(angle), std::sin(angle), 0));
    closed.contacts.push_back(first_touch(part, tcp_from_part, gripper, opening_mm, closed.directions.back()));
    closed.all = closed.all && closed.contacts.back().any;
    closed.any = closed.any || closed.contacts.back().any;
    closed.mean += closed.contacts.back().at / gripper.jaws;
  }
  return closed;
}

/// Friction holds the part: between two jaws along a line that lies in the cones of a contact of each, between more
/// where a contact of each stands across the jaw's way.
bool is_steady(const Closed& closed, double cone) {
  if (closed.contacts.size() == 2) {
    for (const Touch& p : closed.contacts[0].touches)
      for (const Touch& q : closed.contacts[1].touches) {
        const Vec3 line = (p.at - q.at).normalized();
        if (line.dot(p.normal) >= cone && -line.dot(q.normal) >= cone) return true;
      }
    return false;
  }
  for (std::size_t k = 0; k < closed.contacts.size(); ++k) {
    const Vec3& way = closed.directions[k];
    const auto stands = [&](const Touch& touch) { return touch.normal.dot(way) >= cone; };
    if (std::none_of(closed.contacts[k].touches.begin(), closed.contacts[k].touches.end(), stands)) return false;
  }
  return true;
}

/// Two outer jaws press a part that friction does not hold, and it turns about the tool and about the jaws' height as
/// that lets them close, until friction holds it or it can turn no further.
Pose aligned(const grasp::GripperShape& gripper, double opening_mm, const std::vector<SurfacePoint>& part,
             Pose tcp_from_part, double cone) {
  constexpr double kSteps[] = {0.5 * kDegree, 0.1 * kDegree};
  constexpr int kMostSteps = 40;     // of each size: beyond 20 deg it is another grasp
  constexpr double kGain_mm = 0.02;  // less is the spacing of the points
  Closed before = close_on(gripper, opening_mm, part, tcp_from_part);
  double width = before.mean;
  for (const double step : kSteps)
    for (int i = 0; i < kMostSteps; ++i) {
      if (is_steady(before, cone)) return tcp_from_part;
      std::optional<Pose> better;
      for (const Vec3& axis : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitY())})
        for (const double sign : {-1.0, 1.0}) {
          Pose turned = tcp_from_part;
          turned.linear() = rotation_from_vector(sign * step * axis) * tcp_from_part.linear();
          turned.translation() = rotation_from_vector(sign * step * axis) * tcp_from_part.translation();
          const Closed now = close_on(gripper, opening_mm, part, turned);
          if (!now.all || now.mean > width - kGain_mm) continue;
          width = now.mean;
          before = now;
          better = turned;
        }
      if (!better) break;
      tcp_from_part = *better;
    }
  return tcp_from_part;
}

Grip close_jaws(const grasp::GripperShape& gripper, double opening_mm, const Solid::State& solid,
                const Pose& tcp_from_part, double friction, double mass_kg) {
  const std::vector<SurfacePoint> part = near_pads(*solid.mesh, tcp_from_part, gripper);
  Grip grip;
  const auto refuse = [&grip](const char* why) {
    grip.why = why;
    return grip;
  };
  Closed closed = close_on(gripper, opening_mm, part, tcp_from_part);
  grip.touches = closed.any;
  if (!closed.all) return refuse("a jaw meets nothing");
  for (const Contact& contact : closed.contacts)
    if (contact.through) return refuse("the part is wider than the jaws stand open");
  const double cone = std::cos(std::atan(friction));
  Pose seated = tcp_from_part;
  if (gripper.jaws == 2 && !gripper.inside) {
    seated = aligned(gripper, opening_mm, part, tcp_from_part, cone);
    closed = close_on(gripper, opening_mm, part, seated);
  }
  // Jaws move by the same way: the part is shifted until it is as far from the axis at each.
  Vec3 shift = Vec3::Zero();
  const double share = gripper.jaws == 2 ? 0.5 : 2.0 / gripper.jaws;  // least squares over the directions
  for (int k = 0; k < gripper.jaws; ++k) shift += share * (closed.mean - closed.contacts[k].at) * closed.directions[k];
  seated.translation() += shift;
  grip.motion = seated * tcp_from_part.inverse();
  grip.opening_mm = 2 * closed.mean;
  if (gripper.inside && grip.opening_mm < opening_mm) return refuse("the hole is narrower than the jaws");
  if (grip.opening_mm < gripper.stroke_min() || grip.opening_mm > gripper.stroke_max())
    return refuse("the part's width is outside of the stroke");
  if (!is_steady(closed, cone)) return refuse("the surface slants: it slips or turns out of the jaws");
  if (gripper.gripper.force_n > 0 && gripper.jaws * friction * gripper.gripper.force_n < mass_kg * kGravity)
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
    grip.motion.translation().z() = -(low + high) / 2;
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
