#include <algorithm>
#include <cmath>

#include "report/html.hpp"
#include "report/json_values.hpp"
#include "report/shapes.hpp"
#include "report/sketch.hpp"
#include "report/solids.hpp"
#include "tribin/paper_method/pose.hpp"
#include "tribin/paper_method/tests.hpp"

namespace tribin::report {
namespace {

constexpr double kWide = 590, kTall = 560, kPicture = 500;

/// Two key cylinders and a plane, all in the camera's frame.
struct KeySet {
  Primitive main, sub, plane;
};

void draw_cylinder(Sketch& out, const Primitive& c, const std::string& css) {
  const Vec3 low = c.point + c.extent_min * c.axis, high = c.point + c.extent_max * c.axis;
  out.circle(low, c.axis, c.radius_mm, css);
  out.circle(high, c.axis, c.radius_mm, css);
  const Vec3 viewer = out.view().view_from_world.row(2).transpose();
  const Vec3 aside = c.axis.cross(viewer);
  if (aside.norm() > 1e-3)
    for (const double sign : {-1.0, 1.0})
      out.line(low + sign * c.radius_mm * aside.normalized(), high + sign * c.radius_mm * aside.normalized(), css);
}

void draw_key_set(Sketch& out, const KeySet& set, const Vec3& v1) {
  const Vec3 o1 = paper::middle_of(set.main), o2 = paper::middle_of(set.sub);
  const Vec3 offset = paper::across(o1, o2, v1);
  const bool coaxial = offset.norm() < 0.02 * set.main.radius_mm;
  const Matrix3 frame = paper::frame_of(v1, coaxial ? set.plane.axis : offset);
  const double length = 0.62 * set.main.radius_mm;

  Vec3 a, b;
  orthonormal_basis(set.plane.axis, a, b);
  const double half = 0.75 * std::sqrt(set.plane.area_mm2);
  std::vector<Vec3> corners;
  for (const auto& [s, t] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    corners.push_back(set.plane.point + half * (s * a + t * b));
  out.polygon(corners, "plane-fill");
  draw_cylinder(out, set.main, "main");
  draw_cylinder(out, set.sub, "sub");

  // The four points, on the key cylinder whose support the plane is nearer to.
  const auto gap = [&](const Primitive& c) {
    return std::abs(paper::across(c.point, set.plane.point, c.axis).norm() - c.radius_mm);
  };
  const Primitive& cut = gap(set.main) < gap(set.sub) ? set.main : set.sub;
  const auto p = paper::intersection_points(cut, set.plane, frame);
  out.line(p[0], p[1], "plane-line");
  out.line(p[2], p[3], "plane-line");
  out.text(0.5 * (p[0] + p[1]), 8, 16, "l₁", "vec");
  out.text(0.5 * (p[2] + p[3]), 8, -8, "l₂", "vec");

  out.line(o1, o1 + offset, "dash");
  out.line(o1 + offset, o2, "dash");
  out.arrow(o1, o1 + length * v1, "v");
  out.text(o1 + length * v1, 8, 4, "v₁", "vec");
  out.arrow(o2, o2 + length * v1, "v");
  out.text(o2 + length * v1, 8, 4, "v₁′", "vec");
  out.arrow(o1, o1 + length * frame.col(1), "v");
  out.text(o1 + length * frame.col(1), 8, 12, "v₂", "vec");
  out.arrow(o1, o1 + length * frame.col(2), "v");
  out.text(o1 + length * frame.col(2), 8, -8, "v₃", "vec");
  out.dot(o1, 4, "point");
  out.text(o1, -26, 18, "o₁", "vec");
  out.dot(o2, 4, "point");
  out.text(o2, -26, 18, "o₂", "vec");
  const char* const names[] = {"p₁", "p₂", "p₃", "p₄"};
  for (int k = 0; k < 4; ++k) {
    out.dot(p[k], 4.5, "p");
    out.text(p[k], k % 2 ? 7 : -24, k < 2 ? 16 : -7, names[k], "vec");
  }
}

const Primitive& with_id(const std::vector<Primitive>& primitives, int id) {
  return primitives[static_cast<std::size_t>(id - 1)];
}

}  // namespace

std::string figure_geometry(const Scan& scan, const Part& part, const Found& found, const Instance& instance) {
  const Pose& pose = instance.camera_from_part;
  KeySet model, seen;
  Primitive* const of_model[] = {&model.main, &model.sub, &model.plane};
  Primitive* const of_scan[] = {&seen.main, &seen.sub, &seen.plane};
  for (int k = 0; k < 3; ++k) {
    *of_model[k] = json::moved(with_id(part.model.primitives, instance.evidence[k].cad_primitive), pose);
    *of_scan[k] = with_id(found.primitives.items, instance.evidence[k].scan_primitive);
  }
  const Vec3 v1_model = model.main.axis;
  const Vec3 v1_seen = seen.main.axis.dot(v1_model) < 0 ? Vec3(-seen.main.axis) : seen.main.axis;

  const View view = view_of(part.mesh.vertices, pose, static_cast<int>(kPicture));
  Canvas cad(view);
  cad.draw(surface_of(part.mesh, pose, Material::faint));
  draw_edges(cad, part.mesh, edges_of(part.mesh), pose, Material::grey, 1.2, 0);
  const Sighting where = sighting_of(scan, found.surfels, found.primitives, part, pose);
  Canvas cloud(view);
  cloud.draw(surface_of(scan, found.surfels, where, 2, [&](int u, int v) {
    return PixelLook{where.on_part(u, v) ? Material::faint : Material::halo};
  }));

  std::string out;
  const auto side = [&](int column, const Canvas& ground, const KeySet& set, const Vec3& v1, const std::string& title,
                        const std::string& line) {
    Sketch sketch(view);
    draw_key_set(sketch, set, v1);
    const double x = 16 + column * (kWide + 16);
    out += card(x, 16, kWide, kTall, title, {line},
                image_svg(ground, 0, x + 45, 26, kPicture) + "<g transform=\"translate(" + number(x + 45, 1) +
                    " 26)\">" + sketch.svg() + "</g>");
  };
  const auto sizes = [](const KeySet& set) {
    return "key cylinders r " + number(set.main.radius_mm, 2) + " and " + number(set.sub.radius_mm, 2) + " mm, axes " +
           number(paper::across(paper::middle_of(set.main), paper::middle_of(set.sub), set.main.axis).norm(), 2) +
           " mm apart";
  };
  side(0, cad, model, v1_model, "Model (CAD):", sizes(model));
  side(1, cloud, seen, v1_seen, "Observation (scan):", sizes(seen));
  return figure_file(1228, 592, "Geometric relation of two key cylinders and a plane", out);
}

}  // namespace tribin::report
