#pragma once

#include "tribin/cad/mend.hpp"

namespace tribin {

/// Makes the winding of a welded mesh consistent over edges and turns each shell outward; see mend_mesh.
/// Fills flipped, boundary_edges, junction_edges, shells and unoriented_shells of the report, and mesh.oriented.
void mend_winding(Mesh& mesh, MendReport& report);

}  // namespace tribin
