#include "tribin/grasp/convex.hpp"

#include <algorithm>
#include <cmath>

#include "gjk.hpp"

namespace tribin::grasp {
namespace {

/// z along a direction.
Pose pose_along(const Vec3& center, const Vec3& axis) {
  Vec3 u, v;
  orthonormal_basis(axis, u, v);
  Pose pose = Pose::Identity();
  pose.linear().col(0) = u;
  pose.linear().col(1) = v;
  pose.linear().col(2) = axis;
  pose.translation() = center;
  return pose;
}

}  // namespace

Convex make_box(const Pose& frame_from_box, const Vec3& size_mm) {
  Convex body;
  body.frame_from_body = frame_from_box;
  body.half_mm = 0.5 * size_mm;
  return body;
}

Convex make_cylinder(const Vec3& center_mm, const Vec3& axis, double radius_mm, double height_mm) {
  Convex body;
  body.frame_from_body = pose_along(center_mm, axis);
  body.half_mm.z() = 0.5 * height_mm;
  body.disc_mm = radius_mm;
  return body;
}

Convex make_capsule(const Vec3& from_mm, const Vec3& to_mm, double radius_mm) {
  const Vec3 along = to_mm - from_mm;
  const double length = along.norm();
  Convex body;
  body.frame_from_body = pose_along(0.5 * (from_mm + to_mm), length > 0 ? Vec3(along / length) : Vec3(Vec3::UnitZ()));
  body.half_mm.z() = 0.5 * length;
  body.radius_mm = radius_mm;
  return body;
}

Convex moved(const Pose& b_from_a, const Convex& in_a) {
  Convex in_b = in_a;
  in_b.frame_from_body = b_from_a * in_a.frame_from_body;
  in_b.sweep_mm = b_from_a.linear() * in_a.sweep_mm;
  return in_b;
}

Vec3 support(const Convex& body, const Vec3& direction) {
  const Matrix3& r = body.frame_from_body.linear();
  const Vec3 d = r.transpose() * direction;
  Vec3 local(d.x() < 0 ? -body.half_mm.x() : body.half_mm.x(), d.y() < 0 ? -body.half_mm.y() : body.half_mm.y(),
             d.z() < 0 ? -body.half_mm.z() : body.half_mm.z());
  if (body.disc_mm > 0) {
    const double across = std::hypot(d.x(), d.y());
    if (across > 0) {
      local.x() += body.disc_mm * d.x() / across;
      local.y() += body.disc_mm * d.y() / across;
    }
  }
  Vec3 point = body.frame_from_body.translation() + r * local;
  if (body.sweep_mm.dot(direction) > 0) point += body.sweep_mm;
  return point;
}

double reach_along(const Convex& body, const Vec3& unit) { return support(body, unit).dot(unit) + body.radius_mm; }

double distance_mm(const Convex& a, const Convex& b, double enough) {
  const double balls = a.radius_mm + b.radius_mm;
  const auto difference = [&](const gjk::V& d) -> gjk::V { return support(a, d) - support(b, -d); };
  const gjk::V start =
      a.frame_from_body.translation() + 0.5 * a.sweep_mm - b.frame_from_body.translation() - 0.5 * b.sweep_mm;
  return std::max(0.0, gjk::distance(difference, start, enough + balls) - balls);
}

}  // namespace tribin::grasp
