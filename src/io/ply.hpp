#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/file_bytes.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin::io {

/// What tribin needs of a PLY file, in the file's unit.
struct PlyContent {
  std::vector<Vec3f> points;           ///< element "vertex"; NaN and inf are kept
  std::vector<std::uint32_t> corners;  ///< vertex numbers of all polygons, one after the other; all < points.size()
  std::vector<std::uint32_t> polygon_sizes;  ///< corners of each polygon
  int width = 0;                             ///< organized: points.size() = width * height; else 0
  int height = 0;
};

/// Parses PLY: ascii and both binary orders, any elements and properties.
/// Organized by `num_cols` / `num_rows` or `width` / `height` in a comment or obj_info, or by an element "range_grid".
/// \throws Error bad_input, naming line or byte.
PlyContent parse_ply(const FileBytes& file);

}  // namespace tribin::io
