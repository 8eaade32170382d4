#pragma once

#include "io/file_bytes.hpp"
#include "io/ply.hpp"
#include "tribin/cad/mesh.hpp"

namespace tribin::io {

// Parsers of mesh files. Each gives a soup of triangles in the file's unit, not yet welded or mended; mend_mesh does
// it.

/// STL, ascii or binary (told apart by the size that the count asks for, not by the word "solid").
Mesh parse_stl(const FileBytes& file);

/// The polygons of a PLY file, cut into triangles.
Mesh parse_ply_mesh(const FileBytes& file);

}  // namespace tribin::io
