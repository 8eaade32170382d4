#pragma once

#include <TopoDS_Shape.hxx>

#include "tribin/cad_exchange/read_step.hpp"

namespace tribin::detail {

/// The exact surfaces and the triangles of all faces of a shape, whose lengths are mm.
Mesh mesh_of_shape(const TopoDS_Shape& shape, const TessellationOptions& options);

/// The exact surface of the TopoDS_Face `face`. What is swept or a spline but within `tolerance` [mm] of a plane, a
/// cylinder, a cone or a sphere is called that.
CadFace exact_face(const TopoDS_Shape& face, int id, double tolerance);

/// Distance of a point from a plane, cylinder, cone, sphere or torus [mm], >= 0; 0 for free form.
double distance_to(const CadFace& face, const Vec3& point);

/// Turns what a face says of its side (a plane's normal, `concave`, a cone's axis into its nappe) to what the mesh's
/// triangles say.
void take_sides_of_triangles(Mesh& mesh);

}  // namespace tribin::detail
