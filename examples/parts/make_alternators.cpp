// Writes alternator_a, alternator_b and battery as STEP, STL and DXF: the parts of the demo and of the paper's
// experiment. usage: make_alternators DIRECTORY
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#include "alternators.hpp"
#include "compact_step.hpp"
#include "tribin/cad_exchange/read_step.hpp"

namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary);
  out << bytes;
  if (!out.flush()) throw std::runtime_error(path.string() + ": cannot be written");
}

void write_step(const TopoDS_Shape& shape, const std::string& name, const fs::path& path) {
  STEPControl_Writer writer;
  Interface_Static::SetCVal("write.step.schema", "AP214IS");
  Interface_Static::SetCVal("write.step.product.name", name.c_str());
  Interface_Static::SetIVal("write.surfacecurve.mode", 0);  // curves on surfaces can be computed, and double the size
  if (writer.Transfer(shape, STEPControl_AsIs) != IFSelect_RetDone || writer.Write(path.c_str()) != IFSelect_RetDone)
    throw std::runtime_error(path.string() + ": cannot be written");
  write(path, parts::compact_step(text_of(path)));
}

void write_stl(const tribin::Mesh& mesh, const fs::path& path) {
  std::string bytes("tribin example part, mm");
  bytes.resize(80, ' ');
  const auto append = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const tribin::Vec3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const tribin::Vec3f n = (b - a).cross(c - a).normalized();
    for (const tribin::Vec3f& v : {n, a, b, c})
      for (int k = 0; k < 3; ++k) append(v[k]);
    append(std::uint16_t{0});
  }
  write(path, bytes);
}

/// A length to 0.01 mm, a twentieth of the chord error, without zeros that say nothing: DXF is text.
std::string number(double mm) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.2f", mm);
  std::string s(buffer);
  s.erase(s.find_last_not_of('0') + 1);
  if (s.back() == '.') s.pop_back();
  if (const std::size_t zero = s.find("0."); zero == 0 || (zero == 1 && s[0] == '-')) s.erase(zero, 1);
  return s == "-0" || s.empty() ? "0" : s;
}

/// Corners of each 3DFACE: flat pairs of triangles as quads, which halves the file; a triangle repeats its last corner.
std::vector<std::array<std::uint32_t, 4>> quads_of(const tribin::Mesh& mesh) {
  const auto& triangles = mesh.triangles;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> triangle_of_edge;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) triangle_of_edge[{triangles[i][k], triangles[i][(k + 1) % 3]}] = i;
  const auto normal = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const tribin::Vec3f& p = mesh.vertices[a];
    return tribin::Vec3f((mesh.vertices[b] - p).cross(mesh.vertices[c] - p).normalized());
  };
  std::vector<bool> used(triangles.size());
  std::vector<std::array<std::uint32_t, 4>> quads;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (used[i]) continue;
    const auto& t = triangles[i];
    std::array<std::uint32_t, 4> quad{t[0], t[1], t[2], t[2]};
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      const auto other = triangle_of_edge.find({b, a});
      if (other == triangle_of_edge.end() || other->second <= i || used[other->second]) continue;
      const auto& o = triangles[other->second];
      const std::uint32_t d = o[0] != a && o[0] != b ? o[0] : o[1] != a && o[1] != b ? o[1] : o[2];
      const tribin::Vec3f n = normal(a, b, c);
      // Flat to a third of the DXF's last digit over a part of 100 mm; convex, so that either diagonal gives the same.
      if (n.dot(normal(b, a, d)) < 1 - 1e-9f || n.dot(normal(a, d, c)) < 0.999f || n.dot(normal(d, b, c)) < 0.999f)
        continue;
      quad = {a, d, b, c};
      used[other->second] = true;
      break;
    }
    quads.push_back(quad);
  }
  return quads;
}

void write_dxf(const tribin::Mesh& mesh, const fs::path& path) {
  std::ostringstream out;
  out << "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  for (const auto& quad : quads_of(mesh)) {
    out << "0\n3DFACE\n8\n0\n";
    for (int corner = 0; corner < 4; ++corner)
      for (int axis = 0; axis < 3; ++axis)
        out << 10 * (axis + 1) + corner << '\n' << number(mesh.vertices[quad[corner]][axis]) << '\n';
  }
  out << "0\nENDSEC\n0\nEOF\n";
  write(path, out.str());
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::cerr << "usage: make_alternators DIRECTORY\n";
    return 2;
  }
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  const fs::path directory = argv[1];
  fs::create_directories(directory);
  const auto make = [&](const TopoDS_Shape& shape, const std::string& name) {
    const std::string base = (directory / name).string();
    write_step(shape, name, base + ".step");
    // STL and DXF as people export them: coarser than the exact faces.
    const tribin::Mesh mesh = tribin::read_step(base + ".step", {.chord_error_mm = 0.25, .angle = 1.0});
    write_stl(mesh, base + ".stl");
    write_dxf(mesh, base + ".dxf");
    std::cout << name << ": " << mesh.faces.size() << " faces, " << mesh.triangles.size() << " triangles\n";
  };
  make(parts::alternator_a(), "alternator_a");
  make(parts::alternator_b(), "alternator_b");
  make(parts::battery(), "battery");
  return 0;
} catch (const Standard_Failure& e) {
  std::cerr << "make_alternators: " << e.GetMessageString() << '\n';
  return 70;
} catch (const std::exception& e) {
  std::cerr << "make_alternators: " << e.what() << '\n';
  return 70;
}
