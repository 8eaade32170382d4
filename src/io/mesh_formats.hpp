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

/// OBJ: polygons with positive or negative numbers; texture and normals are not needed.
Mesh parse_obj(const FileBytes& file);

/// DXF: what dxf_content.hpp lists, each INSERT in its place, in mm where $INSUNITS says what the file's unit is.
/// `unit_known` tells whether it did.
Mesh parse_dxf(const FileBytes& file, bool& unit_known);

}  // namespace tribin::io
