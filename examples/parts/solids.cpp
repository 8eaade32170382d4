#include "solids.hpp"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <BRep_Tool.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <ShapeUpgrade_UnifySameDomain.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <cmath>
#include <gp_Circ.hxx>
#include <numbers>
#include <stdexcept>
#include <string>

namespace parts {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const gp_Ax1 kAxis(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1));

TopoDS_Shape turned_about_z(const TopoDS_Shape& shape, double angle) {
  gp_Trsf turn;
  turn.SetRotation(kAxis, angle * kDegree);
  return BRepBuilderAPI_Transform(shape, turn, /*copy=*/true).Shape();
}

TopoDS_Shape prism(const TopoDS_Wire& outline, const gp_Vec& direction) {
  return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(outline).Face(), direction).Shape();
}

TopoDS_Edge line(const gp_Pnt& a, const gp_Pnt& b) { return BRepBuilderAPI_MakeEdge(a, b).Edge(); }
TopoDS_Edge arc(const gp_Pnt& a, const gp_Pnt& middle, const gp_Pnt& b) {
  return BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(a, middle, b).Value()).Edge();
}

/// Rounds the rims of a prism along z: the edges that lie across z.
TopoDS_Shape with_round_rims(const TopoDS_Shape& solid, double radius) {
  BRepFilletAPI_MakeFillet fillet(solid);
  TopTools_IndexedMapOfShape edges;
  TopExp::MapShapes(solid, TopAbs_EDGE, edges);
  for (int i = 1; i <= edges.Extent(); ++i) {
    const TopoDS_Edge edge = TopoDS::Edge(edges(i));
    const gp_Pnt a = BRep_Tool::Pnt(TopExp::FirstVertex(edge)), b = BRep_Tool::Pnt(TopExp::LastVertex(edge));
    if (std::abs(a.Z() - b.Z()) < 1e-9) fillet.Add(radius, edge);
  }
  return fillet.Shape();
}

template <class Operation>
TopoDS_Shape combined(const TopoDS_Shape& body, const std::vector<TopoDS_Shape>& others, const std::string& what) {
  TopTools_ListOfShape arguments, tools;
  arguments.Append(body);
  for (const TopoDS_Shape& shape : others) tools.Append(shape);
  Operation operation;
  operation.SetArguments(arguments);
  operation.SetTools(tools);
  operation.Build();
  if (!operation.IsDone() || operation.HasErrors()) throw std::runtime_error(what + " failed");
  // Faces of one surface that the operation cut into pieces become one again.
  ShapeUpgrade_UnifySameDomain unify(operation.Shape(), true, true, false);
  unify.Build();
  return unify.Shape();
}

}  // namespace

Place polar(double angle, double distance) {
  return {distance * std::cos(angle * kDegree), distance * std::sin(angle * kDegree)};
}

TopoDS_Shape turned(const std::vector<Corner>& profile) {
  const std::size_t n = profile.size();
  std::vector<gp_Pnt> in(n), centre(n), out(n);  // where the rounding of each corner begins, its centre, where it ends
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t k) { return gp_Pnt(profile[k % n].r, 0, profile[k % n].z); };
    const gp_Pnt corner = at(i);
    in[i] = centre[i] = out[i] = corner;
    if (profile[i].fillet <= 0) continue;
    const gp_Dir before(gp_Vec(corner, at(i + n - 1))), after(gp_Vec(corner, at(i + 1)));
    const double half = before.Angle(after) / 2, radius = profile[i].fillet;
    const gp_Dir inward(gp_Vec(before) + gp_Vec(after));
    in[i].Translate(gp_Vec(before) * (radius / std::tan(half)));
    out[i].Translate(gp_Vec(after) * (radius / std::tan(half)));
    centre[i].Translate(gp_Vec(inward) * (radius / std::sin(half)));
  }
  BRepBuilderAPI_MakeWire wire;
  for (std::size_t i = 0; i < n; ++i) {
    if (profile[i].fillet > 0) {
      // The short way round from `in` to `out`: counter-clockwise about +y or -y.
      const gp_Vec turn = gp_Vec(centre[i], in[i]).Crossed(gp_Vec(centre[i], out[i]));
      const gp_Ax2 frame(centre[i], gp_Dir(0, turn.Y() > 0 ? 1 : -1, 0), gp_Dir(1, 0, 0));
      wire.Add(BRepBuilderAPI_MakeEdge(gp_Circ(frame, profile[i].fillet), in[i], out[i]).Edge());
    }
    const gp_Pnt next = in[(i + 1) % n];
    if (out[i].Distance(next) > 1e-9) wire.Add(line(out[i], next));
  }
  return BRepPrimAPI_MakeRevol(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), kAxis).Shape();
}

TopoDS_Shape rod(double x, double y, double radius, double z0, double z1) {
  return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, z0), gp_Dir(0, 0, 1)), radius, z1 - z0).Shape();
}

TopoDS_Shape hexagon(double x, double y, double across, double z0, double z1) {
  const double r = across / std::sqrt(3.0);
  BRepBuilderAPI_MakeWire wire;
  for (int i = 0; i < 6; ++i) {
    const Place a = polar(60 * i, r), b = polar(60 * ((i + 1) % 6), r);
    wire.Add(line(gp_Pnt(x + a.x, y + a.y, z0), gp_Pnt(x + b.x, y + b.y, z0)));
  }
  return prism(wire.Wire(), gp_Vec(0, 0, z1 - z0));
}

TopoDS_Shape block(double angle, double x0, double x1, double y0, double y1, double z0, double z1) {
  return turned_about_z(BRepPrimAPI_MakeBox(gp_Pnt(x0, y0, z0), gp_Pnt(x1, y1, z1)).Shape(), angle);
}

TopoDS_Shape ear(double angle, double distance, double radius, double base_half, double z0, double z1) {
  // The sides are tangents of the boss and of a circle of radius base_half about the axis.
  const double s = (base_half - radius) / distance, c = std::sqrt(1 - s * s);
  const gp_Pnt a(base_half * s, -base_half * c, z0), b(distance + radius * s, -radius * c, z0);
  const gp_Pnt tip(distance + radius, 0, z0), d(b.X(), -b.Y(), z0), e(a.X(), -a.Y(), z0);
  BRepBuilderAPI_MakeWire wire;
  wire.Add(line(a, b));
  wire.Add(arc(b, tip, d));
  wire.Add(line(d, e));
  wire.Add(line(e, a));
  return turned_about_z(with_round_rims(prism(wire.Wire(), gp_Vec(0, 0, z1 - z0)), 1.5), angle);
}

TopoDS_Shape ring_sector(double angle, double width_angle, double r0, double r1, double z0, double z1) {
  BRepBuilderAPI_MakeWire wire;
  const gp_Pnt p[4] = {{r0, 0, z0}, {r1, 0, z0}, {r1, 0, z1}, {r0, 0, z1}};
  for (int i = 0; i < 4; ++i) wire.Add(line(p[i], p[(i + 1) % 4]));
  const TopoDS_Face section = BRepBuilderAPI_MakeFace(wire.Wire()).Face();
  return turned_about_z(BRepPrimAPI_MakeRevol(section, kAxis, width_angle * kDegree).Shape(), angle - width_angle / 2);
}

TopoDS_Shape fused(const TopoDS_Shape& body, const std::vector<TopoDS_Shape>& more) {
  return combined<BRepAlgoAPI_Fuse>(body, more, "fuse");
}

TopoDS_Shape cut(const TopoDS_Shape& body, const std::vector<TopoDS_Shape>& tools) {
  return combined<BRepAlgoAPI_Cut>(body, tools, "cut");
}

}  // namespace parts
