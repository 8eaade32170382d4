#pragma once

#include "tribin/cad/mesh.hpp"

namespace tribin {

/// What mend_mesh found.
struct MendReport {
  std::size_t welded = 0;          ///< vertices that became part of another
  std::size_t degenerate = 0;      ///< triangles without area, dropped
  std::size_t duplicate = 0;       ///< triangles with the corners of an earlier one, dropped
  std::size_t flipped = 0;         ///< triangles whose winding was turned
  std::size_t boundary_edges = 0;  ///< edges of one triangle: the shell is open there
  std::size_t junction_edges = 0;  ///< edges of three triangles or more
  int shells = 0;                  ///< parts of the mesh connected over edges of two triangles
  int unoriented_shells = 0;       ///< open shells whose outside could not be told
};

/// Makes a triangle soup into a mesh: welds, drops degenerate and duplicate triangles, makes the winding consistent
/// over edges and turns each shell outward (a closed shell by ray parity, so that a cavity faces its hollow; an open
/// one by which side is seen from outside). What was done is added to `mesh.warnings`; `mesh.oriented` is false where
/// the outside could not be told. `face_of_triangle` is kept in step. \throws Error bad_input for a vertex that is not
/// finite or an index out of range, too_little_data when no triangle
///               is left.
MendReport mend_mesh(Mesh& mesh);

/// Joins vertices closer than the tolerance [mm] (0 = bitwise equal); the first of them in order stays, triangles are
/// renumbered, unused vertices dropped. \return the number of vertices that went into another.
std::size_t weld_vertices(Mesh& mesh, double tolerance_mm);

}  // namespace tribin
