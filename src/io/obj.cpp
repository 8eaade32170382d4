#include <cmath>

#include "io/mesh_formats.hpp"
#include "io/text_cursor.hpp"
#include "tribin/cad/polygon.hpp"

namespace tribin::io {
namespace {

/// The vertex of "7", "7/2", "7//3" or "-1" (the last one so far).
std::uint32_t corner_of(const FileBytes& file, std::size_t begin, std::string_view word, std::size_t vertices) {
  const std::string_view number = word.substr(0, word.find('/'));
  std::int64_t index = 0;
  if (!whole_number(number, index))
    bad_file(file.name, at_line(file.view(), begin), in_quotes(word), "a vertex number");
  const std::int64_t from_zero = index > 0 ? index - 1 : static_cast<std::int64_t>(vertices) + index;
  if (index == 0 || from_zero < 0 || from_zero >= static_cast<std::int64_t>(vertices)) {
    bad_file(file.name, at_line(file.view(), begin), "vertex " + std::to_string(index),
             "1.." + std::to_string(vertices) + ", or negative to count back");
  }
  return static_cast<std::uint32_t>(from_zero);
}

}  // namespace

Mesh parse_obj(const FileBytes& file) {
  Mesh mesh;
  TextCursor cursor(file);
  std::string_view line;
  std::string joined;
  std::vector<std::uint32_t> face;
  std::vector<Vec3> corners;
  bool odd = false;
  for (std::size_t begin = 0; cursor.next_line(line); begin = cursor.position()) {
    if (line.ends_with('\\')) {  // a face of many corners goes on in the next line
      joined.clear();
      while (line.ends_with('\\')) {
        joined.append(line.substr(0, line.size() - 1)).append(" ");
        if (!cursor.next_line(line)) break;
      }
      joined.append(line.ends_with('\\') ? std::string_view() : line);
      line = joined;
    }
    if (line.find('\0') != line.npos) bad_file(file.name, at_line(file.view(), begin), "binary data", "text (OBJ)");
    const auto words = words_of(line);
    if (words.empty() || words[0][0] == '#') continue;
    if (words[0] == "v") {
      double p[3];
      bool good = words.size() >= 4;
      for (int c = 0; c < 3 && good; ++c) good = whole_number(words[c + 1], p[c]) && std::isfinite(p[c]);
      if (!good) bad_file(file.name, at_line(file.view(), begin), in_quotes(line), "v x y z");
      mesh.vertices.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
    } else if (words[0] == "f") {
      if (words.size() < 4)
        bad_file(file.name, at_line(file.view(), begin), in_quotes(line), "a face of 3 corners or more");
      face.clear();
      corners.clear();
      for (std::size_t i = 1; i < words.size(); ++i) {
        face.push_back(corner_of(file, begin, words[i], mesh.vertices.size()));
        corners.push_back(mesh.vertices[face.back()].cast<double>());
      }
      for (const auto& t : triangulate_polygon(corners)) mesh.triangles.push_back({face[t[0]], face[t[1]], face[t[2]]});
    } else if (words[0] == "surf" || words[0] == "curv" || words[0] == "cstype") {
      odd = true;
    } else {
      constexpr std::string_view kKnown[] = {"vn",        "vt",       "vp",     "g",     "o",     "s",    "l",
                                             "p",         "usemtl",   "mtllib", "mg",    "bevel", "lod",  "shadow_obj",
                                             "trace_obj", "deg",      "parm",   "trim",  "hole",  "end",  "usemap",
                                             "maplib",    "curv2",    "scrv",   "sp",    "con",   "bmat", "step",
                                             "c_interp",  "d_interp", "ctech",  "stech", "call",  "csh"};
      bool known = false;
      for (std::string_view k : kKnown) known |= words[0] == k;
      if (!known) bad_file(file.name, at_line(file.view(), begin), in_quotes(line), "a statement of OBJ (v, f ..)");
    }
  }
  if (odd) mesh.warnings.push_back("free-form surfaces of the OBJ file were left out; only its polygons are read");
  if (mesh.triangles.empty()) bad_file(file.name, "", "no face", "faces (f a b c)", ErrorCode::too_little_data);
  return mesh;
}

}  // namespace tribin::io
