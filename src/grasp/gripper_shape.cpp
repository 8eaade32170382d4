#include "tribin/grasp/gripper_shape.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin::grasp {
namespace {

// What ends that near to the TCP's plane is meant to reach it: drawings are rounded to millimetres.
constexpr double kReaches_mm = 5;
// Fingers that nobody drew: a quarter as thick and wide as long, and no shorter than the smallest on the market.
constexpr double kSlender = 4, kShortest_mm = 20;

/// A body's extents along the axes of the TCP.
struct Extents {
  Vec3 low, high;
};

Extents extents_of(const Convex& body) {
  Extents e;
  for (int k = 0; k < 3; ++k) {
    e.high[k] = reach_along(body, Vec3::Unit(k));
    e.low[k] = -reach_along(body, -Vec3::Unit(k));
  }
  return e;
}

Convex box_between(const Vec3& low, const Vec3& high) {
  Pose pose = Pose::Identity();
  pose.translation() = 0.5 * (low + high);
  return make_box(pose, high - low);
}

std::vector<Convex> drawn_bodies(const Gripper& gripper) {
  const Pose tcp_from_flange = gripper.flange_from_tcp.inverse();
  std::vector<Convex> bodies;
  for (const CellBox& box : gripper.boxes) {
    Pose pose = Pose::Identity();
    pose.translation() = box.center_mm;
    bodies.push_back(moved(tcp_from_flange, make_box(pose, box.size_mm)));
  }
  for (const CellCylinder& c : gripper.cylinders)
    bodies.push_back(moved(tcp_from_flange, make_cylinder(c.center_mm, c.axis, c.radius_mm, c.height_mm)));
  return bodies;
}

/// Builds the jaws of one gripper and keeps what they have in common for its pad.
class Jaws {
 public:
  explicit Jaws(GripperShape& shape) : shape_(shape) {}

  /// \param tips  z of tips; \param length, width, thickness of the jaw in mm
  void add_fingers(double thickness, double width, double length, double tip) {
    for (int k = 0; k < shape_.jaws; ++k) {
      const double angle = k * 2 * kPi / shape_.jaws;
      // Seen along its travel, a jaw's contact face lies at 0 and its body outside of it (inside: within it).
      const double near = shape_.inside ? -thickness : 0, far = shape_.inside ? 0 : thickness;
      Pose turned = Pose::Identity();
      turned.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      const Convex finger = box_between(Vec3(near, -width / 2, tip - length), Vec3(far, width / 2, tip));
      const Vec3 outward(std::cos(angle), std::sin(angle), 0);
      shape_.pieces.push_back({moved(turned, finger), 0.5 * outward, true});
    }
    note_pad(width, length, tip);
  }

  /// A jaw as it was drawn, beside the middle.
  void add_drawn(const Convex& body, const Vec3& outward, double width) {
    const double face = shape_.inside ? reach_along(body, outward) : -reach_along(body, -outward);
    Convex closed = body;
    closed.frame_from_body.translation() -= face * outward;
    shape_.pieces.push_back({closed, 0.5 * outward, true});
    const Extents e = extents_of(body);
    note_pad(width, e.high.z() - e.low.z(), e.high.z());
  }

 private:
  void note_pad(double width, double length, double tip) {
    Pad& pad = shape_.pad;
    const double back = tip - length;
    if (first_) {
      pad = {width, length, tip};
      first_ = false;
      return;
    }
    // What all jaws have at the same height.
    const double low = std::max(pad.tip_mm - pad.length_mm, back);
    pad.width_mm = std::min(pad.width_mm, width);
    pad.tip_mm = std::min(pad.tip_mm, tip);
    pad.length_mm = std::max(pad.tip_mm - low, 0.0);
  }

  GripperShape& shape_;
  bool first_ = true;
};

/// The closed jaws drawn as one block: fingers as long as half the largest part that they can hold, the rest is body.
void cut_block(GripperShape& shape, Jaws& jaws, const Extents& e) {
  const double length = std::min(e.high.z() - e.low.z(), std::max(shape.stroke_max() / 2, kShortest_mm));
  double thickness = std::max(-e.low.x(), e.high.x());
  if (shape.inside && shape.stroke_min() > 0) thickness = std::min(thickness, shape.stroke_min() / 2);
  jaws.add_fingers(thickness, e.high.y() - e.low.y(), length, e.high.z());
  if (e.low.z() < e.high.z() - length) {
    const Vec3 top(e.high.x(), e.high.y(), e.high.z() - length);
    shape.pieces.push_back({box_between(e.low, top), Vec3::Zero(), false});
  }
}

void add_jaws(GripperShape& shape, const std::vector<Convex>& bodies) {
  Jaws jaws(shape);
  const Vec3& finger = shape.gripper.finger_mm;
  if (!finger.isZero()) jaws.add_fingers(finger.x(), finger.y(), finger.z(), shape.gripper.tip_mm);
  bool have = !finger.isZero();
  double front = -1e300;
  for (const Convex& body : bodies) {
    const Extents e = extents_of(body);
    const bool reaches = e.high.z() >= -kReaches_mm && e.high.z() > e.low.z();
    if (!finger.isZero() || !reaches) {
      shape.pieces.push_back({body, Vec3::Zero(), false});
      front = std::max(front, e.high.z());
      continue;
    }
    const Vec3 center = 0.5 * (e.low + e.high);
    const bool beside = shape.jaws == 2 ? e.low.x() >= 0 || e.high.x() <= 0
                                        : e.low.x() >= 0 || e.high.x() <= 0 || e.low.y() >= 0 || e.high.y() <= 0;
    have = true;
    if (!beside) {
      cut_block(shape, jaws, e);
    } else if (shape.jaws == 2) {
      jaws.add_drawn(body, Vec3(center.x() > 0 ? 1 : -1, 0, 0), e.high.y() - e.low.y());
    } else {
      const Vec3 outward = Vec3(center.x(), center.y(), 0).normalized(), across(-outward.y(), outward.x(), 0);
      jaws.add_drawn(body, outward, reach_along(body, across) + reach_along(body, -across));
    }
  }
  if (have) return;
  const double flange = -(shape.gripper.flange_from_tcp.inverse().translation()).z();
  const double length = std::max(bodies.empty() ? std::abs(flange) : -front, kShortest_mm);
  jaws.add_fingers(length / kSlender, length / kSlender, length, 0);
  shape.warnings.push_back("gripper " + shape.gripper.name + ": it draws no jaws; taken as fingers of " +
                           std::to_string(std::lround(length / kSlender)) + " mm, " +
                           std::to_string(std::lround(length)) + " mm long (finger_mm says it)");
}

void add_cup(GripperShape& shape, const std::vector<Convex>& bodies) {
  double drawn = 0, front = -1e300;
  for (const Convex& body : bodies) {
    const Extents e = extents_of(body);
    const bool reaches = e.high.z() >= -kReaches_mm;
    shape.pieces.push_back({body, Vec3::Zero(), reaches});
    front = std::max(front, e.high.z());
    if (reaches) drawn = std::max(drawn, std::min({-e.low.x(), e.high.x(), -e.low.y(), e.high.y()}));
  }
  shape.cup_mm = shape.gripper.cup_radius_mm > 0 ? shape.gripper.cup_radius_mm : drawn;
  if (!(shape.cup_mm > 0))
    throw Error(ErrorCode::bad_input,
                "gripper " + shape.gripper.name +
                    ": saw no cup_radius_mm and no body that reaches the TCP, wanted one of them");
  if (drawn > 0) return;
  const double flange = (shape.gripper.flange_from_tcp.inverse().translation()).z();
  const double back = std::min(bodies.empty() ? flange : front, -1.0);
  shape.pieces.push_back({make_cylinder(Vec3(0, 0, back / 2), Vec3::UnitZ(), shape.cup_mm, -back), Vec3::Zero(), true});
}

}  // namespace

GripperShape gripper_shape(const Gripper& gripper) {
  GripperShape shape;
  shape.gripper = gripper;
  shape.inside = gripper.kind == GripperKind::parallel_inside;
  const std::vector<Convex> bodies = drawn_bodies(gripper);
  if (gripper.kind == GripperKind::suction || gripper.kind == GripperKind::magnet) {
    add_cup(shape, bodies);
  } else {
    shape.jaws = gripper.kind == GripperKind::three_jaw ? 3 : 2;
    add_jaws(shape, bodies);
  }
  return shape;
}

std::vector<Convex> pieces_at(const GripperShape& shape, double opening_mm) {
  std::vector<Convex> out;
  for (const GripperPiece& piece : shape.pieces) {
    Convex body = piece.body;
    body.frame_from_body.translation() += opening_mm * piece.travel;
    out.push_back(body);
  }
  return out;
}

}  // namespace tribin::grasp
