#include <cmath>

#include "io/binary.hpp"
#include "io/mesh_formats.hpp"
#include "io/text_cursor.hpp"

namespace tribin::io {
namespace {

constexpr std::size_t kHeader = 84;  // 80 bytes of text and the count
constexpr std::size_t kFacet = 50;   // normal, 3 corners, 2 bytes of attributes

void add_triangle(Mesh& mesh, const Vec3f corner[3]) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 3; ++i) mesh.vertices.push_back(corner[i]);
  mesh.triangles.push_back({first, first + 1, first + 2});
}

Mesh parse_binary(const FileBytes& file, std::size_t count) {
  Mesh mesh;
  mesh.vertices.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* facet = file.data.data() + kHeader + i * kFacet + 12;  // the normal follows from the corners
    Vec3f corner[3];
    for (int k = 0; k < 9; ++k) corner[k / 3][k % 3] = load<float>(facet + 4 * k, kBigEndianHost);
    for (const Vec3f& p : corner) {
      if (!p.allFinite()) {
        bad_file(file.name, "facet " + std::to_string(i) + ", " + at_byte(kHeader + i * kFacet + 12),
                 "a coordinate that is no number", "finite coordinates");
      }
    }
    add_triangle(mesh, corner);
  }
  if (file.size() > kHeader + count * kFacet) {
    mesh.warnings.push_back(std::to_string(file.size() - kHeader - count * kFacet) +
                            " bytes after the last facet were left out");
  }
  return mesh;
}

Mesh parse_ascii(const FileBytes& file) {
  Mesh mesh;
  TextCursor cursor(file);
  std::string_view line;
  cursor.next_line(line);  // solid NAME
  Vec3f corner[3] = {Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero()};
  int corners = 0;
  bool ended = false;
  for (std::string_view word = cursor.next_word(); !word.empty(); word = cursor.next_word()) {
    if (word == "vertex") {
      if (corners == 3) bad_file(file.name, cursor.place(), "a fourth vertex", "endloop after three");
      for (int c = 0; c < 3; ++c) {
        corner[corners][c] = cursor.number<float>("a coordinate");
        if (!std::isfinite(corner[corners][c])) {
          bad_file(file.name, cursor.place(), "a coordinate that is no number", "finite coordinates");
        }
      }
      ++corners;
    } else if (word == "endfacet") {
      if (corners != 3) bad_file(file.name, cursor.place(), std::to_string(corners) + " vertices in a facet", "3");
      add_triangle(mesh, corner);
      corners = 0;
    } else if (word == "facet" || word == "outer" || word == "loop" || word == "endloop" || word == "normal") {
      if (word == "normal") {
        for (int c = 0; c < 3; ++c) cursor.next_word();  // often wrong, even "nan": the corners tell
      }
    } else if (word == "endsolid") {
      cursor.next_line(line);
      ended = true;
    } else if (word == "solid") {
      cursor.next_line(line);  // several solids in one file are one rigid part
      ended = false;
    } else {
      bad_file(file.name, cursor.place(), in_quotes(word), "facet, vertex or endsolid");
    }
  }
  if (!ended) bad_file(file.name, cursor.place(), "the end of the file", "endsolid");
  return mesh;
}

}  // namespace

Mesh parse_stl(const FileBytes& file) {
  const std::string_view bytes = file.view();
  const std::size_t count = bytes.size() >= kHeader ? load<std::uint32_t>(bytes.data() + 80, kBigEndianHost) : 0;
  const bool exact = bytes.size() >= kHeader && bytes.size() == kHeader + count * kFacet;
  const bool text = bytes.starts_with("solid") && bytes.substr(0, 2000).find('\0') == bytes.npos;
  if (text && !exact) return parse_ascii(file);
  if (bytes.size() < kHeader) {
    bad_file(file.name, "", std::to_string(bytes.size()) + " bytes", "STL: \"solid\", or a binary header of 84 bytes");
  }
  if (bytes.size() < kHeader + count * kFacet) {
    bad_file(file.name, "byte 80",
             "a count of " + std::to_string(count) + " facets in " + std::to_string(bytes.size()) + " bytes",
             std::to_string(kHeader + count * kFacet) + " bytes for them, or a count of " +
                 std::to_string((bytes.size() - kHeader) / kFacet));
  }
  return parse_binary(file, count);
}

}  // namespace tribin::io
