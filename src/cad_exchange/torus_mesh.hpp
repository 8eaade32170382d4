#pragma once

#include <IMeshTools_Context.hxx>

namespace tribin::detail {

/// Open CASCADE's meshing, but with as many triangles on a torus as the chord error needs: its own rule makes the steps
/// along a fillet shorter by the ratio of the steps along and across, 5 to 10 times too many on a housing's rim.
Handle(IMeshTools_Context) mesh_context();

}  // namespace tribin::detail
