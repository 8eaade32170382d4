#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tribin/io/cad_files.hpp"
#include "tribin/io/scan_files.hpp"

namespace tribin {

struct ConvertOptions {
  ScanReadOptions scan;
  CadReadOptions cad;
};

/// What a conversion did.
struct Converted {
  std::string kind;        ///< "scan", "points" or "mesh"
  std::size_t points = 0;  ///< valid points, or vertices
  std::size_t triangles = 0;
  std::vector<std::string> warnings;
};

/// Converts any readable scan or CAD file into any writable one; the extensions say what they are. PLY is a mesh where
/// it has faces and the output can hold them, else points. \throws Error as the readers and writers; bad_option where
/// the output cannot hold what the input is.
Converted convert(const std::filesystem::path& input, const std::filesystem::path& output,
                  const ConvertOptions& options = {});

}  // namespace tribin
