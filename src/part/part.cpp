#include "tribin/part/part.hpp"

#include <cmath>

#include "coarse_mesh.hpp"
#include "flat_extent.hpp"
#include "tribin/core/error.hpp"
#include "tribin/part/symmetry.hpp"
#include "views.hpp"

namespace tribin {
namespace {

/// Axes about which two or more self-similar turns go: the part is nearly round there, and every spin is worth a look.
std::vector<ContinuousSymmetry> nearly_round_axes(const Part& part) {
  constexpr double kOverlap = 0.85;  // less in place, and the listed turns are apart from each other
  struct Axis {
    ContinuousSymmetry line;
    int turns = 0;
  };
  std::vector<Axis> axes;
  for (const SelfSimilarPose& s : part.self_similar) {
    if (s.overlap < kOverlap) continue;
    const Eigen::AngleAxisd turn{Eigen::Matrix3d(s.part_from_part.linear())};
    // The fixed point nearest to the box centre: (I - R) p = t, solved across the axis.
    const Eigen::Matrix3d m =
        Eigen::Matrix3d::Identity() - s.part_from_part.linear() + turn.axis() * turn.axis().transpose();
    const Eigen::Vector3d c = part.box_center();
    const Eigen::Vector3d t = s.part_from_part.translation();
    Eigen::Vector3d p = m.fullPivLu().solve(t - turn.axis() * turn.axis().dot(t));
    p += turn.axis() * turn.axis().dot(c - p);
    bool known = false;
    for (Axis& a : axes) {
      const Eigen::Vector3d off = p - Eigen::Vector3d(a.line.point);
      if (std::abs(turn.axis().dot(Eigen::Vector3d(a.line.axis))) < std::cos(3 * kDegree) ||
          off.norm() > 0.03 * part.diameter_mm)
        continue;
      ++a.turns;
      known = true;
    }
    if (!known) axes.push_back({{Vec3(turn.axis()), Vec3(p)}, 1});
  }
  std::vector<ContinuousSymmetry> out;
  for (const Axis& a : axes)
    if (a.turns >= 2) out.push_back(a.line);
  return out;
}

}  // namespace

Part compile_part(const Mesh& mesh, const PartOptions& options) {
  Part part;
  part.name = options.name.empty() ? mesh.name : options.name;
  part.mesh = mesh;
  part.render_mesh = make_render_mesh(mesh);
  part.box_min = part.render_mesh.box_min;
  part.box_max = part.render_mesh.box_max;
  constexpr int kDirections = 1024;  // right to 0.01 %
  part.diameter_mm = largest_distance(mesh.vertices, kDirections);
  part.coarse_error_mm = 0.001 * part.diameter_mm;  // a tenth of the first look-ups' tolerance
  part.coarse_mesh = make_render_mesh(coarse_mesh(mesh, part.coarse_error_mm));

  double moment = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    const double area = 0.5 * (b - a).cross(c - a).norm();
    part.area_mm2 += area;
    moment += area * ((a + b + c) / 3 - Eigen::Vector3d(part.box_center())).squaredNorm();
  }
  if (!(part.area_mm2 > 0) || !(part.diameter_mm > 0))
    throw Error(ErrorCode::too_little_data, part.name + ": the CAD has no surface (" +
                                                std::to_string(mesh.triangles.size()) +
                                                " triangles, area 0); a closed or open surface is wanted");
  part.gyration_mm = std::sqrt(moment / part.area_mm2);

  const Surfels surfels = surfels_from_mesh(part.mesh);
  const Primitives primitives = segment(surfels);
  part.model = build_model(primitives, surfels);
  part.primitive_of_triangle = primitives.label_of_surfel;
  TRIBIN_ASSERT(part.primitive_of_triangle.size() == mesh.triangles.size());
  part.largest_face_mm = largest_flat_extent(part);
  make_views(part);
  SymmetryResult symmetry = find_symmetries(part.mesh);
  part.symmetry = std::move(symmetry.group);
  part.self_similar = std::move(symmetry.self_similar);
  part.nearly_round = nearly_round_axes(part);
  part.warnings = mesh.warnings;
  return part;
}

}  // namespace tribin
