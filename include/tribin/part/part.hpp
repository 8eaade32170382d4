#pragma once

#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/model/primitive_model.hpp"
#include "tribin/pose/index_render.hpp"

namespace tribin {

/// Turning by any angle about this axis leaves the part as it is.
struct ContinuousSymmetry {
  Vec3 axis = Vec3::UnitZ();
  Vec3 point = Vec3::Zero();
};

/// The rigid motions that leave the part as it is (part_from_part).
struct SymmetryGroup {
  std::vector<Pose> discrete;                  ///< with the identity first
  std::vector<ContinuousSymmetry> continuous;  ///< none or one; three for a ball
};

/// A pose that leaves most of the surface in place, and what tells it from the true one.
struct SelfSimilarPose {
  Pose part_from_part = Pose::Identity();
  double overlap = 0;                        ///< share of the surface that stays in place
  std::vector<Vec3f> discriminating_points;  ///< on the part, where the two differ
};

/// What a camera sees of the part from one direction.
struct PartView {
  Vec3 direction = Vec3::UnitZ();  ///< unit, from the part towards the camera, part frame
  std::vector<Vec3f> points;       ///< visible surface points, part frame; any prefix covers the view evenly
  std::vector<Vec3f> normals;      ///< their facets' normals
  double area_mm2 = 0;             ///< projected
};

/// A CAD file made ready for finding it in scans.
struct Part {
  std::string name;
  Mesh mesh;
  RenderMesh render_mesh;
  RenderMesh coarse_mesh;      ///< of fewer triangles, for looks at few pixels
  double coarse_error_mm = 0;  ///< its largest distance from the mesh: a thousandth of the diameter
  PrimitiveModel model;
  std::vector<double> exposed_mm2;  ///< of each primitive: projected area, mean over all views (0 = never seen)
  std::vector<std::int32_t> primitive_of_triangle;  ///< primitive id, 0 = none
  Vec3 box_min = Vec3::Zero();
  Vec3 box_max = Vec3::Zero();
  double diameter_mm = 0;      ///< largest distance between two vertices
  double largest_face_mm = 0;  ///< no piece of surface that may be taken for one plane is longer (flat_extent.hpp)
  double area_mm2 = 0;
  double gyration_mm = 0;  ///< rms distance of the surface from the box centre: turns radians into mm
  SymmetryGroup symmetry;
  SymmetryGroup declared;  ///< motions that make no difference to who uses the part, though details of it move; empty
                           ///< as compiled, see declare_free_spin
  std::vector<SelfSimilarPose> self_similar;
  std::vector<ContinuousSymmetry>
      nearly_round;  ///< axes about which turns leave most of the part in place: spins are searched
  std::vector<PartView> views;
  std::vector<Vec3f> sample_points;   ///< of all that can be seen, 5 % of the diameter apart
  std::vector<Vec3f> sample_normals;  ///< their facets' normals, outward
  std::vector<std::string> warnings;

  Vec3 box_center() const { return 0.5 * (box_min + box_max); }
};

/// The view whose direction is nearest to a direction in the part frame.
const PartView& nearest_view(const Part& part, const Vec3& direction);

struct PartOptions {
  std::string name;  ///< empty = the mesh's name
};

/// Compiles a CAD mesh into a part: primitives by the one segmentation, symmetries, views.
/// \throws Error too_little_data for a mesh without area.
Part compile_part(const Mesh& mesh, const PartOptions& options = {});

}  // namespace tribin
