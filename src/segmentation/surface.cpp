#include <cmath>

#include "segmentation/fitting.hpp"

namespace tribin::segmentation_detail {

double Surface::distance(const Vec3& p) const {
  const Vec3 q = p - point;
  switch (type) {
    case PrimitiveType::plane:
      return axis.dot(q);
    case PrimitiveType::sphere:
      return q.norm() - radius;
    case PrimitiveType::cylinder:
      return (q - axis * axis.dot(q)).norm() - radius;
    case PrimitiveType::torus: {
      const double t = axis.dot(q);
      return std::hypot((q - axis * t).norm() - radius, t) - minor_radius;
    }
    case PrimitiveType::cone: {
      const double t = axis.dot(q);
      return ((q - axis * t).norm() - radius) * std::cos(half_angle) - t * std::sin(half_angle);
    }
  }
  return 0;
}

Vec3 Surface::normal(const Vec3& p) const {
  if (type == PrimitiveType::plane) return axis;
  const Vec3 q = p - point;
  Vec3 n = q;
  if (type != PrimitiveType::sphere) n = q - axis * axis.dot(q);
  const double length = n.norm();
  if (length < 1e-9) return axis;
  n /= length;
  if (type == PrimitiveType::torus) {
    n = q - n * radius;  // from the circle that the tube runs along
    n.normalize();
  }
  if (type == PrimitiveType::cone) n = n * std::cos(half_angle) - axis * std::sin(half_angle);
  return concave ? Vec3(-n) : n;
}

int parameters_of(PrimitiveType type) {
  switch (type) {
    case PrimitiveType::plane:
      return 3;
    case PrimitiveType::sphere:
      return 4;
    case PrimitiveType::cylinder:
      return 5;
    case PrimitiveType::cone:
      return 6;
    case PrimitiveType::torus:
      return 7;
  }
  return 0;
}

}  // namespace tribin::segmentation_detail
