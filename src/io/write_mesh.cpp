#include <algorithm>
#include <charconv>
#include <cstdint>

#include "io/atomic_file.hpp"
#include "io/binary.hpp"
#include "io/file_bytes.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

/// The shortest text that reads back as the same float.
std::string text_of(float value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, end);
}

std::string stl_of(const Mesh& mesh) {
  std::string out = "binary STL in millimetres";
  out.resize(80, ' ');
  io::append(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const Vec3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3f normal = Vec3f((b - a).cross(c - a)).normalized();
    for (const Vec3f* p : {&normal, &a, &b, &c}) {
      for (int k = 0; k < 3; ++k) io::append(out, (*p)[k]);
    }
    io::append(out, std::uint16_t{0});
  }
  return out;
}

std::string ply_of(const Mesh& mesh) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment unit mm\nelement vertex " +
                    std::to_string(mesh.vertices.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                    std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3f& p : mesh.vertices) {
    for (int k = 0; k < 3; ++k) io::append(out, p[k]);
  }
  for (const auto& t : mesh.triangles) {
    io::append(out, std::uint8_t{3});
    for (std::uint32_t corner : t) io::append(out, corner);
  }
  return out;
}

std::string obj_of(const Mesh& mesh) {
  std::string out = "# millimetres\n";
  for (const Vec3f& p : mesh.vertices) {
    out += "v " + text_of(p.x()) + " " + text_of(p.y()) + " " + text_of(p.z()) + "\n";
  }
  for (const auto& t : mesh.triangles) {
    out += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
  }
  return out;
}

std::string dxf_of(const Mesh& mesh) {
  // R12 takes 3DFACE without handles; $INSUNITS is younger, yet all readers take it from the header.
  std::string out =
      "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  for (const auto& t : mesh.triangles) {
    out += "0\n3DFACE\n8\n0\n";
    for (int corner = 0; corner < 4; ++corner) {  // a triangle repeats its last corner
      const Vec3f& p = mesh.vertices[t[std::min(corner, 2)]];
      for (int k = 0; k < 3; ++k) out += std::to_string(10 * (k + 1) + corner) + "\n" + text_of(p[k]) + "\n";
    }
  }
  return out + "0\nENDSEC\n0\nEOF\n";
}

}  // namespace

std::vector<std::string> writable_mesh_extensions() { return {".stl", ".ply", ".obj", ".dxf"}; }

void write_mesh(const std::filesystem::path& path, const Mesh& mesh) {
  const std::string extension = io::lower_extension(path);
  if (extension == ".stl") return io::write_file(path, stl_of(mesh));
  if (extension == ".ply") return io::write_file(path, ply_of(mesh));
  if (extension == ".obj") return io::write_file(path, obj_of(mesh));
  if (extension == ".dxf") return io::write_file(path, dxf_of(mesh));
  io::bad_file(path.string(), "", "extension " + io::in_quotes(extension), "a mesh to write (.stl .ply .obj .dxf)",
               ErrorCode::bad_option);
}

}  // namespace tribin
