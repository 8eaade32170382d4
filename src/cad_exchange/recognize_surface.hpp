#pragma once

#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin::detail {

/// A point of a smooth surface with its unit normal.
struct SurfacePoint {
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
};

/// Names a surface that is given by points alone: a cylinder that was written as a spline is still a cylinder.
/// \param points     some dozens of points spread over the face, with normals.
/// \param tolerance  largest distance of a point from the surface found [mm].
/// \return           type (free_form if none fits) and the parameters that belong to it.
/// \source           ours: normals of planes, cylinders and cones keep one dot product with the axis (the paper's
///                   section III-B); centre and radius then follow from p = c + R n, which is linear.
CadFace recognize_surface(const std::vector<SurfacePoint>& points, double tolerance);

}  // namespace tribin::detail
