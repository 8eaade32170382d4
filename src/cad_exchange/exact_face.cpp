#include <Adaptor3d_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepGProp.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <cmath>
#include <gp_Circ.hxx>
#include <gp_Cone.hxx>
#include <gp_Cylinder.hxx>
#include <gp_Pln.hxx>
#include <gp_Sphere.hxx>
#include <gp_Torus.hxx>
#include <optional>

#include "cad_exchange/recognize_surface.hpp"
#include "cad_exchange/shape_mesh.hpp"

namespace tribin::detail {
namespace {

Vec3 vec(const gp_XYZ& p) { return {p.X(), p.Y(), p.Z()}; }
Vec3 vec(const gp_Pnt& p) { return vec(p.XYZ()); }
Vec3 vec(const gp_Dir& d) { return vec(d.XYZ()); }

/// The surface at (u, v) with the outward normal; zero normal where the surface is singular.
SurfacePoint surface_point(const TopoDS_Face& face, const BRepAdaptor_Surface& surface, double u, double v) {
  gp_Pnt p;
  gp_Vec du, dv;
  surface.D1(u, v, p, du, dv);
  const gp_Vec n = du.Crossed(dv);
  if (n.Magnitude() < 1e-12) return {vec(p), Vec3::Zero()};
  // The flag says on which side of du x dv the material lies. du x dv itself turns with a left-handed surface frame, so
  // that the two together are right for holes whatever writer made the file.
  const double sign = face.Orientation() == TopAbs_REVERSED ? -1.0 : 1.0;
  return {vec(p), vec(n.XYZ()) * (sign / n.Magnitude())};
}

/// Points on a grid over the face's parameter range, without singular ones.
std::vector<SurfacePoint> surface_grid(const TopoDS_Face& face, const BRepAdaptor_Surface& surface, int steps) {
  double u0, u1, v0, v1;
  BRepTools::UVBounds(face, u0, u1, v0, v1);
  std::vector<SurfacePoint> points;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j) {
      const SurfacePoint s = surface_point(face, surface, u0 + (u1 - u0) * i / steps, v0 + (v1 - v0) * j / steps);
      if (s.normal.norm() > 0.5) points.push_back(s);
    }
  return points;
}

Vec3 across(const CadFace& f, const Vec3& p) {
  const Vec3 d = p - f.point;
  return d - d.dot(f.axis) * f.axis;
}

/// The direction away from the axis, the centre or the tube's centre line at a point of the surface.
Vec3 outwards(const CadFace& f, const Vec3& p) {
  switch (f.type) {
    case SurfaceType::cylinder:
    case SurfaceType::cone:
      return across(f, p);
    case SurfaceType::sphere:
      return p - f.point;
    case SurfaceType::torus: {
      const Vec3 radial = across(f, p);
      return radial.norm() > 0 ? Vec3(p - (f.point + radial.normalized() * f.radius_mm)) : Vec3(Vec3::Zero());
    }
    default:
      return Vec3::Zero();
  }
}

/// A circle that turns about a line in its plane is a torus, though some writers call it a surface of revolution.
std::optional<CadFace> as_torus(const BRepAdaptor_Surface& surface, double tolerance) {
  const Handle(Adaptor3d_Curve) curve = surface.BasisCurve();
  if (curve->GetType() != GeomAbs_Circle) return {};
  const gp_Circ circle = curve->Circle();
  const gp_Ax1 axis = surface.AxeOfRevolution();
  CadFace f;
  f.type = SurfaceType::torus;
  f.axis = vec(axis.Direction());
  const Vec3 centre = vec(circle.Location()), normal = vec(circle.Axis().Direction());
  const Vec3 origin = vec(axis.Location());
  f.point = origin + (centre - origin).dot(f.axis) * f.axis;
  f.radius_mm = (centre - f.point).norm();
  f.minor_radius_mm = circle.Radius();
  const bool in_plane = std::abs(normal.dot(f.axis)) * f.minor_radius_mm < tolerance &&
                        std::abs(normal.dot(centre - f.point)) < tolerance;
  return in_plane ? std::optional(f) : std::nullopt;
}

/// Type and parameters, without what depends on the side of the material.
CadFace bare_face(const TopoDS_Face& face, const BRepAdaptor_Surface& surface, double tolerance) {
  CadFace f;
  switch (surface.GetType()) {
    case GeomAbs_Plane:
      f.type = SurfaceType::plane;
      f.axis = vec(surface.Plane().Axis().Direction());
      f.point = vec(surface.Plane().Location());
      return f;
    case GeomAbs_Cylinder:
      f.type = SurfaceType::cylinder;
      f.axis = vec(surface.Cylinder().Axis().Direction());
      f.point = vec(surface.Cylinder().Location());
      f.radius_mm = surface.Cylinder().Radius();
      return f;
    case GeomAbs_Cone:
      f.type = SurfaceType::cone;
      f.axis = vec(surface.Cone().Axis().Direction());
      f.point = vec(surface.Cone().Apex());
      f.half_angle = std::abs(surface.Cone().SemiAngle());
      return f;
    case GeomAbs_Sphere:
      f.type = SurfaceType::sphere;
      f.point = vec(surface.Sphere().Location());
      f.radius_mm = surface.Sphere().Radius();
      return f;
    case GeomAbs_Torus:
      f.type = SurfaceType::torus;
      f.axis = vec(surface.Torus().Axis().Direction());
      f.point = vec(surface.Torus().Location());
      f.radius_mm = surface.Torus().MajorRadius();
      f.minor_radius_mm = surface.Torus().MinorRadius();
      return f;
    case GeomAbs_SurfaceOfRevolution:
      if (const std::optional<CadFace> torus = as_torus(surface, tolerance)) return *torus;
      [[fallthrough]];
    default:
      // Open CASCADE's own conversion (ShapeCustom::SweptToElementary) crashes on some files and knows no splines.
      return recognize_surface(surface_grid(face, surface, 8), tolerance);
  }
}

}  // namespace

CadFace exact_face(const TopoDS_Shape& shape, int id, double tolerance) {
  const TopoDS_Face& face = TopoDS::Face(shape);
  if (BRep_Tool::Surface(face).IsNull()) return {.id = id};
  const BRepAdaptor_Surface surface(face);
  CadFace result = bare_face(face, surface, tolerance);
  result.id = id;
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(face, properties);
  result.area_mm2 = std::abs(properties.Mass());
  return result;
}

double distance_to(const CadFace& f, const Vec3& p) {
  const double along = f.axis.dot(p - f.point), radial = across(f, p).norm();
  switch (f.type) {
    case SurfaceType::plane:
      return std::abs(along);
    case SurfaceType::cylinder:
      return std::abs(radial - f.radius_mm);
    case SurfaceType::cone:
      return std::abs(radial * std::cos(f.half_angle) - std::abs(along) * std::sin(f.half_angle));
    case SurfaceType::sphere:
      return std::abs((p - f.point).norm() - f.radius_mm);
    case SurfaceType::torus:
      return std::abs(std::hypot(radial - f.radius_mm, along) - f.minor_radius_mm);
    case SurfaceType::free_form:
      return 0;
  }
  return 0;
}

void take_sides_of_triangles(Mesh& mesh) {
  struct Sum {
    Vec3 normal = Vec3::Zero();
    double outwards = 0, along = 0;
  };
  std::vector<Sum> sums(mesh.faces.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto id = static_cast<std::size_t>(mesh.face_of_triangle[i]) - 1;
    const auto& [a, b, c] = mesh.triangles[i];
    const Vec3 p = mesh.vertices[a].cast<double>(), q = mesh.vertices[b].cast<double>(),
               r = mesh.vertices[c].cast<double>();
    const Vec3 normal = (q - p).cross(r - p), middle = (p + q + r) / 3;
    const CadFace& face = mesh.faces[id];
    sums[id].normal += normal;
    sums[id].outwards += normal.dot(outwards(face, middle).normalized());
    sums[id].along += normal.norm() * face.axis.dot(middle - face.point);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    CadFace& face = mesh.faces[i];
    if (face.type == SurfaceType::plane && face.axis.dot(sums[i].normal) < 0) face.axis = -face.axis;
    // The axis points from the apex into the nappe on which the face lies.
    if (face.type == SurfaceType::cone && sums[i].along < 0) face.axis = -face.axis;
    face.concave = sums[i].outwards < 0;
  }
}

}  // namespace tribin::detail
