#include "segmentation/cad_faces.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace tribin::segmentation_detail {
namespace {

constexpr double kSameAngle = 1e-4;  // rad: two faces of one surface, up to the rounding of the exchange file
constexpr double kSameMm = 1e-3;

bool same_line(const CadFace& a, const CadFace& b) {
  const Vec3 q = b.point - a.point;
  return std::abs(a.axis.dot(b.axis)) > std::cos(kSameAngle) && (q - a.axis * a.axis.dot(q)).norm() < kSameMm;
}

bool same_surface(const CadFace& a, const CadFace& b) {
  if (a.type != b.type || a.concave != b.concave) return false;
  switch (a.type) {
    case SurfaceType::plane:
      return a.axis.dot(b.axis) > std::cos(kSameAngle) && std::abs(a.axis.dot(b.point - a.point)) < kSameMm;
    case SurfaceType::cylinder:
      return std::abs(a.radius_mm - b.radius_mm) < kSameMm && same_line(a, b);
    case SurfaceType::cone:
      return std::abs(a.half_angle - b.half_angle) < kSameAngle && (a.point - b.point).norm() < kSameMm &&
             same_line(a, b);
    case SurfaceType::sphere:
      return std::abs(a.radius_mm - b.radius_mm) < kSameMm && (a.point - b.point).norm() < kSameMm;
    case SurfaceType::torus:
      return std::abs(a.radius_mm - b.radius_mm) < kSameMm &&
             std::abs(a.minor_radius_mm - b.minor_radius_mm) < kSameMm && (a.point - b.point).norm() < kSameMm &&
             same_line(a, b);
    case SurfaceType::free_form:
      return false;
  }
  return false;
}

bool is_primitive(const CadFace& face) {
  if (face.type == SurfaceType::torus) return face.minor_radius_mm < face.radius_mm;  // one that meets itself is none
  return face.type != SurfaceType::free_form;
}

Surface surface_of(const CadFace& face, const Surfels& s, const Indices& support) {
  Surface out;
  out.axis = face.axis;
  out.point = face.point;
  out.radius = face.radius_mm;
  out.concave = face.concave;
  switch (face.type) {
    case SurfaceType::plane: {
      out.type = PrimitiveType::plane;
      // Centre of the support, and the side that the triangles say.
      Vec3 center = Vec3::Zero(), facing = Vec3::Zero();
      double area = 0;
      for (std::uint32_t i : support) {
        center += s.area_mm2[i] * s.position[i].cast<double>();
        facing += s.area_mm2[i] * s.normal[i].cast<double>();
        area += s.area_mm2[i];
      }
      center /= std::max(area, 1e-12);
      if (out.axis.dot(facing) < 0) out.axis = -out.axis;
      out.point = center - out.axis * out.axis.dot(center - face.point);
      break;
    }
    case SurfaceType::cone: {
      out.type = PrimitiveType::cone;
      out.half_angle = std::abs(face.half_angle);
      // From the apex into the cone, referred to a place where the radius is not 0.
      double mean = 0;
      for (std::uint32_t i : support) mean += out.axis.dot(s.position[i].cast<double>() - face.point);
      mean /= static_cast<double>(support.size());
      if (mean < 0) out.axis = -out.axis;
      out.point = face.point + out.axis * std::abs(mean);
      out.radius = std::abs(mean) * std::tan(out.half_angle);
      break;
    }
    case SurfaceType::sphere:
      out.type = PrimitiveType::sphere;
      break;
    case SurfaceType::torus:
      out.type = PrimitiveType::torus;
      out.minor_radius = face.minor_radius_mm;
      break;
    default:
      out.type = PrimitiveType::cylinder;
  }
  return out;
}

}  // namespace

void take_cad_faces(Scene& scene, std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  const Mesh& mesh = *s.mesh;
  if (mesh.faces.empty() || mesh.face_of_triangle.size() != mesh.triangles.size()) return;
  std::vector<Indices> triangles(mesh.faces.size());
  std::map<std::int32_t, std::size_t> place;  // face id -> index
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) place[mesh.faces[f].id] = f;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (const auto at = place.find(mesh.face_of_triangle[t]); at != place.end()) triangles[at->second].push_back(t);

  std::vector<std::size_t> group(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) group[f] = f;
  // Faces of one surface are one primitive where they touch: they share an edge of the mesh.
  const auto root = [&](std::size_t i) {
    while (group[i] != i) i = group[i];
    return i;
  };
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint32_t k = s.neighbour_begin[t]; k < s.neighbour_begin[t + 1]; ++k) {
      const auto a = place.find(mesh.face_of_triangle[t]), b = place.find(mesh.face_of_triangle[s.neighbours[k]]);
      if (a == place.end() || b == place.end() || a->second == b->second) continue;
      const std::size_t ra = root(a->second), rb = root(b->second);
      if (ra != rb && same_surface(mesh.faces[ra], mesh.faces[rb])) group[std::max(ra, rb)] = std::min(ra, rb);
    }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const std::size_t r = root(f);
    if (r != f) {
      triangles[r].insert(triangles[r].end(), triangles[f].begin(), triangles[f].end());
      triangles[f].clear();
    }
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (triangles[f].empty() || !is_primitive(mesh.faces[f])) continue;
    FoundSurface next;
    next.fit.surface = surface_of(mesh.faces[f], s, triangles[f]);
    next.fit.valid = true;
    next.support = triangles[f];
    next.arc = next.fit.surface.type == PrimitiveType::plane ? 0.0 : arc_of(s, next.support, next.fit.surface);
    take(scene, found, std::move(next));
  }
}

}  // namespace tribin::segmentation_detail
