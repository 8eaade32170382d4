#pragma once

#include <string>
#include <vector>

#include "io/binary.hpp"
#include "io/file_bytes.hpp"

namespace tribin::io {

struct PlyProperty {
  std::string name;
  Scalar type = Scalar::f32;
  bool is_list = false;
  Scalar count_type = Scalar::u8;
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  /// Bytes of one, or of its shortest possible form where it has lists.
  std::size_t least_bytes() const;
  bool has_list() const;
  /// Index of a property, or -1.
  int find(std::string_view property) const;
};

struct PlyHeader {
  enum class Format { ascii, binary_little_endian, binary_big_endian } format = Format::ascii;
  std::vector<PlyElement> elements;
  std::size_t columns = 0;  ///< of the grid that a comment or obj_info declares; 0 = none
  std::size_t rows = 0;
  std::size_t body = 0;  ///< offset of the first byte after the header
};

/// Parses the header and checks each count against the bytes that are there.
PlyHeader parse_ply_header(const FileBytes& file);

}  // namespace tribin::io
