#pragma once

#include <TopoDS_Shape.hxx>

#include "tribin/cad_exchange/read_step.hpp"

namespace tribin::detail {

/// The exact surfaces and the triangles of all faces of a shape, whose lengths are mm.
Mesh mesh_of_shape(const TopoDS_Shape& shape, const TessellationOptions& options);

/// The exact surface of the TopoDS_Face `face`. What is swept or a spline but within `tolerance` [mm] of a plane, a
/// cylinder, a cone or a sphere is called that.
CadFace exact_face(const TopoDS_Shape& face, int id, double tolerance);

}  // namespace tribin::detail
