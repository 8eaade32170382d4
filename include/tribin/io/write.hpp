#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

// All writers write beside the place and rename then: a reader never sees half a file, and none is left by a failure.
// Lengths are millimetres. \throws Error bad_input when the place cannot be written, bad_option for an unknown
// extension.

/// Writes a scan in the file's own frame by the extension: .ply (binary, organized by obj_info), .pcd (binary,
/// organized), .xyz (text, holes left out), or .png (16-bit depth; camera.json goes beside it as STEM.camera.json).
void write_scan(const std::filesystem::path& path, const Scan& scan);

/// Writes loose points: .ply, .pcd, .xyz.
void write_points(const std::filesystem::path& path, const PointSet& points);

/// Writes a mesh by the extension: .stl (binary), .ply (binary), .obj, .dxf (3DFACE, $INSUNITS millimetres).
void write_mesh(const std::filesystem::path& path, const Mesh& mesh);

std::vector<std::string> writable_scan_extensions();
std::vector<std::string> writable_mesh_extensions();

}  // namespace tribin
