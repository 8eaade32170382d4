#pragma once

#include "report/canvas.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin::report {

/// The point of a primitive's untrimmed surface nearest to x, and the surface's normal there (outward, away from the
/// axis).
struct ShapePoint {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
};
ShapePoint nearest_on(const Primitive& primitive, const Vec3& x);

/// Mesh edges that a draughtsman would draw: creases, rims, and, for one view, silhouettes.
struct Edge {
  std::uint32_t a, b;        ///< vertices
  std::int32_t left, right;  ///< triangles; right = -1 on a border
  bool crease;
};
std::vector<Edge> edges_of(const Mesh& mesh);

/// The mesh with normals smoothed over all but the creases. \param b_from_part moves it.
ShadedSurface surface_of(const Mesh& mesh, const Pose& b_from_part, Material material);

/// Gives each triangle of a part's surface the colour of the primitive of its model that it lies on.
void colour_by_primitives(ShadedSurface& surface, const Part& part, const Pose& b_from_part);

/// Draws the visible edges of a posed mesh. \param canvas holds the depths of that mesh.
void draw_edges(Canvas& canvas, const Mesh& mesh, const std::vector<Edge>& edges, const Pose& b_from_part,
                Material material, double width_px, double halo_px);

/// A lightness step that tells neighbours of one type apart.
float tint_of(int primitive_id);

}  // namespace tribin::report
