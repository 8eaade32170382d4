#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/io/units.hpp"

namespace tribin {

struct CadReadOptions {
  /// Unit of files that name none (STL, OBJ, PLY, DXF without $INSUNITS). `automatic` = millimetre. A file's own unit
  /// wins.
  LengthUnit unit = LengthUnit::automatic;
};

/// Reads a CAD file as a mesh [mm]: STL, PLY, OBJ, DXF, and what is registered (STEP, IGES). Vertices are welded,
/// degenerate and duplicate triangles dropped, the winding mended; `warnings` says what was found.
/// \throws Error bad_input (file, place, seen, wanted), too_little_data (no triangle), bad_option (a format whose
///               component is not built in).
Mesh read_cad(const std::filesystem::path& path, const CadReadOptions& options = {});

using CadReader = std::function<Mesh(const std::filesystem::path&, const CadReadOptions&)>;

/// Makes read_cad hand files of an extension (lower case, with dot) to a reader, which finishes the mesh itself.
/// An optional component calls this once at start, before any file is read.
void register_cad_reader(const std::string& extension, CadReader reader);

/// File extensions that read_cad can read now, lower case, with dot.
std::vector<std::string> cad_extensions();

}  // namespace tribin
