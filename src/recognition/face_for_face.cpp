#include <Eigen/Eigenvalues>
#include <array>

#include "rivals.hpp"

namespace tribin {
namespace {

/// The rectangle around a plane face, along the axes of its second moments.
struct Rectangle {
  Eigen::Matrix3d axes;    ///< columns: along the sides, outward normal
  Eigen::Vector3d corner;  ///< where both sides begin
  std::array<double, 2> sides{};

  /// The same rectangle from its next corner.
  Rectangle from_next_corner() const {
    Rectangle out;
    out.axes << axes.col(1), -axes.col(0), axes.col(2);
    out.corner = corner + axes.col(0) * sides[0];
    out.sides = {sides[1], sides[0]};
    return out;
  }

  /// Moves onto another rectangle: sides along its sides, both beginning there, or ending where the others end.
  Pose onto(const Rectangle& other, const std::array<bool, 2>& at_end) const {
    Pose out;
    out.linear() = other.axes * axes.transpose();
    Eigen::Vector3d to = other.corner;
    for (std::size_t k = 0; k < 2; ++k)
      if (at_end[k]) to += other.axes.col(static_cast<Eigen::Index>(k)) * (other.sides[k] - sides[k]);
    out.translation() = to - out.linear() * corner;
    return out;
  }
};

Rectangle rectangle_of(const Part& part, const Primitive& face) {
  std::vector<Eigen::Vector3d> corners;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  double area = 0;
  for (std::size_t t = 0; t < part.mesh.triangles.size(); ++t) {
    if (part.primitive_of_triangle[t] != face.id) continue;
    std::array<Eigen::Vector3d, 3> v;
    for (std::size_t k = 0; k < 3; ++k) v[k] = part.mesh.vertices[part.mesh.triangles[t][k]].cast<double>();
    corners.insert(corners.end(), v.begin(), v.end());
    const double a = 0.5 * (v[1] - v[0]).cross(v[2] - v[0]).norm();
    const Eigen::Vector3d total = v[0] + v[1] + v[2];
    area += a;
    sum += a / 3 * total;
    moment += a / 12 * (total * total.transpose());
    for (const Eigen::Vector3d& p : v) moment += a / 12 * (p * p.transpose());
  }
  Rectangle out;
  const Eigen::Vector3d n = face.axis, middle = sum / area;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moment / area - middle * middle.transpose());
  const Eigen::Vector3d u = (eigen.eigenvectors().col(2) - n * n.dot(eigen.eigenvectors().col(2))).normalized();
  out.axes << u, n.cross(u), n;
  Eigen::Vector3d least = Eigen::Vector3d::Constant(1e30), most = -least;
  for (const Eigen::Vector3d& p : corners) {
    least = least.cwiseMin(out.axes.transpose() * p);
    most = most.cwiseMax(out.axes.transpose() * p);
  }
  out.corner = out.axes * least;
  out.sides = {most.x() - least.x(), most.y() - least.y()};
  return out;
}

}  // namespace

void add_face_for_face(const Part& part, std::span<const Primitive* const> seen, const Pose& pose,
                       std::vector<Pose>& out) {
  constexpr std::size_t kFaces = 8;  // best exposed
  std::vector<Rectangle> others;
  for (const PartFeature& f : visible_features(part, PrimitiveType::plane, kFaces))
    others.push_back(rectangle_of(part, *f.primitive));
  for (const Primitive* face : seen) {
    if (face->type != PrimitiveType::plane) continue;
    const Rectangle own = rectangle_of(part, *face);
    for (Rectangle other : others)
      for (int quarter = 0; quarter < 4; ++quarter, other = other.from_next_corner())
        for (const bool first : {false, true})
          for (const bool second : {false, true}) {
            // Sides of one length begin and end together.
            const double same = 0.01 * part.diameter_mm;
            if ((first && std::abs(own.sides[0] - other.sides[0]) < same) ||
                (second && std::abs(own.sides[1] - other.sides[1]) < same))
              continue;
            out.push_back(pose * other.onto(own, {first, second}));
          }
  }
}

}  // namespace tribin
