#include "report/solids.hpp"

#include <algorithm>
#include <cmath>

#include "report/patches.hpp"
#include "report/shapes.hpp"

namespace tribin::report {
namespace {

/// About one grid point for each two pixels of the picture.
int stride_for(const Sighting& where, int size_px) {
  return std::max(1, (std::max(where.u1 - where.u0, where.v1 - where.v0) * 2) / size_px);
}

struct Labels {
  Image<std::uint16_t> of_pixel;
  const std::vector<Primitive>& items;
  const Primitive* at(int u, int v) const {
    const int id = of_pixel.contains(u, v) ? of_pixel(u, v) : 0;
    return id > 0 && id <= static_cast<int>(items.size()) ? &items[id - 1] : nullptr;
  }
};

PixelLook look_of_type(const Primitive* p) {
  if (!p) return {Material::none};
  return {material_of(p->type), 0, tint_of(p->id), static_cast<std::uint16_t>(p->id)};
}

bool on_part(const Sighting& where, int u, int v) { return where.on_part.empty() || where.on_part(u, v) != 0; }

/// The plane that the parts stand on: the largest one of the scan. \return the direction away from the camera's side.
struct Height {
  Vec3 up = -Vec3::UnitZ();
  double low = 0, high = 1;
  int step_of(const Vec3& p) const {
    return std::clamp(static_cast<int>((up.dot(p) - low) / (high - low) * kHeights), 0, kHeights - 1);
  }
};
Height height_over(const Observation& seen, const ShadedSurface& surface) {
  Height out;
  const Primitive* largest = nullptr;
  for (const Primitive& p : seen.primitives.items)
    if (p.type == PrimitiveType::plane && (!largest || p.area_mm2 > largest->area_mm2)) largest = &p;
  if (largest) out.up = largest->axis.z() > 0 ? Vec3(-largest->axis) : largest->axis;
  out.low = 1e300, out.high = -1e300;
  for (const Vec3f& v : surface.vertices) {
    const double h = out.up.dot(v.cast<double>());
    out.low = std::min(out.low, h), out.high = std::max(out.high, h);
  }
  if (out.high - out.low < 1e-3) out.high = out.low + 1;
  return out;
}

void paint_heights(ShadedSurface& surface, const Height& height) {
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    surface.materials[t] = Material::height;
    surface.steps[t] =
        static_cast<std::uint8_t>(height.step_of(surface.vertices[surface.triangles[t][0]].cast<double>()));
  }
}

}  // namespace

View view_of(const std::vector<Vec3f>& points, const Pose& camera_from_points, int size_px) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3f& p : points) middle += camera_from_points * p.cast<double>();
  middle /= std::max<std::size_t>(1, points.size());
  const Vec3 ray = middle.norm() > 1 ? Vec3(middle.normalized()) : Vec3(Vec3::UnitZ());
  const Matrix3 turn = rotation_from_vector(Vec3(0, -14 * kDegree, 0)) * rotation_from_vector(Vec3(24 * kDegree, 0, 0));
  View view = view_along(turn * ray, Vec3::UnitY(), middle, 1, size_px, size_px);
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);
  for (const Vec3f& p : points) {
    const Vec3 v = view.view_from_world * (camera_from_points * p.cast<double>() - middle);
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  view.center += view.view_from_world.transpose() * (0.5 * (low + high));
  const double extent = std::max({1e-6, high.x() - low.x(), high.y() - low.y()});
  view.px_per_mm = size_px / (1.06 * extent);
  return view;
}

ScanCanvases scan_canvases(const Observation& seen, const Sighting& where, const View& view) {
  const Labels labels{label_pixels(seen.primitives, seen.surfels), seen.primitives.items};
  const int stride = stride_for(where, view.width);
  const PixelLook out_of_sight{Material::halo};
  ScanCanvases out{Canvas(view), Canvas(view), Canvas(view)};
  ShadedSurface cloud = surface_of(seen.scan, seen.surfels, where, stride,
                                   [&](int u, int v) { return on_part(where, u, v) ? PixelLook{} : out_of_sight; });
  const Height height = height_over(seen, cloud);
  out.height_mm = height.high - height.low;
  paint_heights(cloud, height);
  out.scan.draw(cloud);
  out.segmentation.draw(surface_of(seen.scan, seen.surfels, where, stride, [&](int u, int v) {
    return on_part(where, u, v) ? look_of_type(labels.at(u, v)) : out_of_sight;
  }));
  out.observed.draw(patches_of(seen.scan, where, [&](int u, int v) -> const Primitive* {
    return on_part(where, u, v) ? labels.at(u, v) : nullptr;
  }));
  return out;
}

CadCanvases cad_canvases(const Part& part, const Pose& pose, const View& view) {
  CadCanvases out{Canvas(view), Canvas(view)};
  out.cad.draw(surface_of(part.mesh, pose, Material::grey));
  draw_edges(out.cad, part.mesh, edges_of(part.mesh), pose, Material::line, view.width / 300.0, 0);
  ShadedSurface coloured = surface_of(part.mesh, pose, Material::none);
  colour_by_primitives(coloured, part, pose);
  out.model.draw(coloured);
  return out;
}

Canvas pose_canvas(const Observation& seen, const Sighting& where, const Part& part, const Pose& pose,
                   const View& view) {
  Canvas out(view);
  Sighting around = where;
  around.on_part = {};
  out.draw(surface_of(seen.scan, seen.surfels, around, stride_for(where, view.width),
                      [&](int u, int v) { return PixelLook{where.on_part(u, v) ? Material::grey : Material::faint}; }));
  Canvas hidden(view);
  hidden.draw(surface_of(part.mesh, pose, Material::grey));
  out.depth = hidden.depth;  // lines hide behind the CAD, never behind the scan: the eye must see the misfit
  draw_edges(out, part.mesh, edges_of(part.mesh), pose, Material::class_line, view.width / 190.0, view.width / 320.0);
  return out;
}

}  // namespace tribin::report
