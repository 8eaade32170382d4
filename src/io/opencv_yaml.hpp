#pragma once

#include <map>
#include <string>
#include <vector>

#include "io/file_bytes.hpp"

namespace tribin::io {

/// A matrix of numbers (a scalar is 1 x 1) and where it stands in the file.
struct YamlMatrix {
  int rows = 0, cols = 0;
  std::vector<double> data;  ///< row-wise
  std::string file, place;   ///< "line 12, M1"
};

/// Reads the small part of YAML that OpenCV's FileStorage writes: top-level keys with `!!opencv-matrix` or a number.
/// Other values (strings, sequences, maps) are left out.
/// \throws Error bad_input (file, line, seen, wanted).
std::map<std::string, YamlMatrix> parse_opencv_yaml(const FileBytes& file);

}  // namespace tribin::io
