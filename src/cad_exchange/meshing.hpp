#pragma once

#include <IMeshTools_Context.hxx>

namespace tribin::detail {

/// Open CASCADE's meshing, but with as many triangles as the chord error needs on two kinds of surface:
/// - a torus, where its own rule makes the steps along a fillet shorter by the ratio of the steps along and across, 5
/// to
///   10 times too many on a housing's rim;
/// - a plane, cylinder or cone that is written as swept or as a spline: refining these until all normals agree has no
///   end near an apex (47,674 triangles on a cone of 348).
/// \param tolerance  within which a surface is taken for a plane, cylinder or cone [mm].
Handle(IMeshTools_Context) mesh_context(double tolerance);

}  // namespace tribin::detail
