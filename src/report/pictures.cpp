#include "report/pictures.hpp"

#include <algorithm>
#include <cmath>

#include "report/html.hpp"
#include "report/patches.hpp"
#include "report/shapes.hpp"
#include "report/sighting.hpp"
#include "report/spaces.hpp"
#include "tribin/eval/eval.hpp"

namespace tribin::report {
namespace {

std::string figure(const std::string& letter, const std::string& caption, const std::string& art) {
  return "<figure><div class=\"art\">" + art + "</div><figcaption>" +
         (letter.empty() ? "" : "<b>" + letter + "</b>\u2002") + escaped(caption) + "</figcaption></figure>\n";
}

std::string painted(const Canvas& canvas, int part_class, const std::string& alt) {
  return picture(canvas.indices, palette(false, part_class), palette(true, part_class), alt);
}

/// Looks at points from the camera's side, 24 degrees lower and 14 degrees from the left, so that steps and heights
/// show.
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

int stride_for(const Scan& scan, const Sighting& where, int size_px) {
  // About one grid point for each two pixels of the picture.
  (void)scan;
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
  return {material_of(p->type), 0, tint_of(p->id)};
}

bool on_part(const Sighting& where, int u, int v) { return where.on_part.empty() || where.on_part(u, v) != 0; }

std::vector<PeakMark> marks(const Primitives& primitives, const Sighting& where, PrimitiveType type, std::size_t most) {
  std::vector<PeakMark> out;
  for (int k : where.primitives) {
    const Primitive& p = primitives.items[k];
    if (p.type != type || out.size() >= most) continue;
    const auto same = std::find_if(out.begin(), out.end(), [&](const PeakMark& m) {
      return std::abs(m.direction.dot(p.axis)) > std::cos(10 * kDegree);  // one ring for those that would overlap
    });
    if (same == out.end()) out.push_back({p.axis, (type == PrimitiveType::plane ? "P" : "C") + std::to_string(p.id)});
  }
  return out;
}

std::vector<CircleMark> circles(const Primitives& primitives, const Sighting& where, std::size_t most) {
  std::vector<CircleMark> out;
  for (int k : where.primitives) {
    const Primitive& p = primitives.items[k];
    if (out.size() >= most || (p.type != PrimitiveType::cylinder && p.type != PrimitiveType::cone)) continue;
    const bool cone = p.type == PrimitiveType::cone;
    const CircleMark mark{p.axis, cone ? (p.concave ? 1 : -1) * std::sin(p.half_angle) : 0, "C" + std::to_string(p.id),
                          name_of(p.type)};
    const auto same = std::find_if(out.begin(), out.end(), [&](const CircleMark& m) {
      return std::abs(m.axis.dot(mark.axis)) > std::cos(3 * kDegree) && std::abs(m.d - mark.d) < 0.05;
    });
    if (same == out.end()) out.push_back(mark);
  }
  return out;
}

/// Pictures (a) to (d): the spaces.
std::string space_pictures(const Observation& seen, const Sighting& where, const std::string& of_what) {
  const auto of_shape = [&](auto keep) {
    std::vector<std::uint32_t> out;
    for (std::uint32_t i : where.surfels)
      if (keep(seen.surfels.shape[i])) out.push_back(i);
    return count_normals(seen.surfels, out, 4096);
  };
  const auto all = count_normals(seen.surfels, where.surfels, 4096);
  const auto flat = of_shape([](SurfelShape s) { return s == SurfelShape::flat; });
  const auto curved = of_shape([](SurfelShape s) { return s == SurfelShape::ruled || s == SurfelShape::curved; });
  std::string out;
  out += figure("a", "IJK space: every normal of " + of_what + " as a point on the half sphere",
                sphere_svg(all, {}, {}, "Half sphere of all normals"));
  out += figure(
      "b", "Dense spots of the flat surfels: candidates for planes",
      sphere_svg(flat, marks(seen.primitives, where, PrimitiveType::plane, 5), {}, "Half sphere of flat surfels"));
  out += figure("c", "The curved surfels: a cylinder is a great circle, a cone a small one",
                sphere_svg(curved, {}, circles(seen.primitives, where, 3), "Half sphere of curved surfels"));
  out += figure("d", "Parameter space of the whole scan: votes for the axis (θ outwards, φ around), d = 0, log scale",
                disc_svg(seen.primitives.spaces.parameter, marks(seen.primitives, where, PrimitiveType::cylinder, 5),
                         "Equal-area disc of axis votes"));
  return out;
}

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

/// Pictures (e), (f), (g): the cloud, its segmentation, the primitives fitted to it.
std::string scan_solids(const Observation& seen, const Sighting& where, const View& view, const Labels& labels,
                        int part_class) {
  const int stride = stride_for(seen.scan, where, view.width);
  const PixelLook out_of_sight{Material::halo};
  std::string out;
  {
    ShadedSurface cloud = surface_of(seen.scan, seen.surfels, where, stride,
                                     [&](int u, int v) { return on_part(where, u, v) ? PixelLook{} : out_of_sight; });
    const Height height = height_over(seen, cloud);
    paint_heights(cloud, height);
    Canvas canvas(view);
    canvas.draw(cloud);
    out += figure("e", "Scan, coloured by height over " + number(height.high - height.low, 0) + " mm",
                  painted(canvas, part_class, "The scanned surface, coloured by height"));
  }
  {
    Canvas canvas(view);
    canvas.draw(surface_of(seen.scan, seen.surfels, where, stride, [&](int u, int v) {
      return on_part(where, u, v) ? look_of_type(labels.at(u, v)) : out_of_sight;
    }));
    out +=
        figure("f", "Segmentation by type; grey is unexplained", painted(canvas, part_class, "Segmentation by type"));
  }
  {
    Canvas canvas(view);
    canvas.draw(patches_of(seen.scan, where, [&](int u, int v) -> const Primitive* {
      return on_part(where, u, v) ? labels.at(u, v) : nullptr;
    }));
    out += figure("g", "Model observed in the scan: the fitted surfaces, trimmed to what was seen",
                  painted(canvas, part_class, "Fitted primitives"));
  }
  return out;
}

/// Pictures (h) and (i): the CAD, and the model made from it.
std::string cad_solids(const Part& part, const Pose& pose, const View& view, int part_class) {
  const std::vector<Edge> edges = edges_of(part.mesh);
  const double width = view.width / 300.0;
  Canvas cad(view);
  cad.draw(surface_of(part.mesh, pose, Material::grey));
  draw_edges(cad, part.mesh, edges, pose, Material::line, width, 0);
  Canvas model(view);
  ShadedSurface coloured = surface_of(part.mesh, pose, Material::none);
  colour_by_primitives(coloured, part, pose);
  model.draw(coloured);
  return figure("h", "CAD as read: " + grouped(static_cast<long long>(part.mesh.triangles.size())) + " triangles",
                painted(cad, part_class, "The CAD part")) +
         figure("i", "Model made from the CAD, by the same segmentation",
                painted(model, part_class, "Primitives of the CAD part"));
}

}  // namespace

std::string ten_pictures(const Observation& seen, const Part& part, const Instance* instance, int part_class,
                         int size_px) {
  if (!instance) return part_pictures(part, size_px);
  const Pose& pose = instance->camera_from_part;
  const Sighting where = sighting_of(seen.scan, seen.surfels, seen.primitives, part, pose);
  const Labels labels{label_pixels(seen.primitives, seen.surfels), seen.primitives.items};
  const View view = view_of(part.mesh.vertices, pose, size_px);

  Canvas posed(view);
  Sighting around = where;
  around.on_part = {};
  posed.draw(surface_of(seen.scan, seen.surfels, around, stride_for(seen.scan, where, size_px), [&](int u, int v) {
    return PixelLook{where.on_part(u, v) ? Material::grey : Material::faint};
  }));
  Canvas hidden(view);
  hidden.draw(surface_of(part.mesh, pose, Material::grey));
  posed.depth = hidden.depth;  // lines hide behind the CAD, never behind the scan: the eye must see the misfit
  draw_edges(posed, part.mesh, edges_of(part.mesh), pose, Material::class_line, size_px / 190.0, size_px / 320.0);

  return space_pictures(seen, where, "this part") + scan_solids(seen, where, view, labels, part_class) +
         cad_solids(part, pose, view, part_class) +
         figure("j", "Pose: the CAD's outline on the scan", painted(posed, part_class, "CAD outline over the scan"));
}

std::string scan_pictures(const Observation& seen, int size_px) {
  const Sighting where = whole_scan(seen.scan, seen.surfels, seen.primitives);
  const Labels labels{label_pixels(seen.primitives, seen.surfels), seen.primitives.items};
  const View view = view_of(seen.surfels.position, Pose::Identity(), size_px);
  return space_pictures(seen, where, "the scan") + scan_solids(seen, where, view, labels, 0);
}

std::string part_pictures(const Part& part, int size_px) {
  Pose pose = Pose::Identity();  // from the front, above: the part's z upwards
  pose.linear() = rotation_from_vector(Vec3(90 * kDegree, 0, 0));
  pose.linear() = rotation_from_vector(Vec3(0, 0, 30 * kDegree)) * pose.linear();
  pose.translation() = Vec3(0, 0, 10 * part.diameter_mm) - pose.linear() * part.box_center();
  return cad_solids(part, pose, view_of(part.mesh.vertices, pose, size_px), 0);
}

std::string picture_legend() {
  std::string out = "<div class=\"leg\">";
  for (PrimitiveType type : {PrimitiveType::plane, PrimitiveType::cylinder, PrimitiveType::cone, PrimitiveType::sphere})
    out += "<span>" + type_icon(type) + name_of(type) + "</span>";
  out +=
      "<span>low <i class=\"ramp viridis\"></i> high (viridis)</span><span>few <i class=\"ramp magma\"></i> many "
      "(magma)</span>";
  return out + "</div>\n";
}

namespace {

/// Leaves out the rows of a picture, above and below, where no part was found; a twelfth of its width stays around
/// them.
void keep_rows_with_parts(View& view, std::span<const Part> parts, const std::vector<Instance>& instances) {
  double low = 1e300, high = -1e300;
  for (const Instance& instance : instances)
    for (const Part& part : parts) {
      if (part.name != instance.part) continue;
      for (const Vec3f& x : part.mesh.vertices) {
        const double y = view.project(instance.camera_from_part * x.cast<double>()).y();
        low = std::min(low, y), high = std::max(high, y);
      }
    }
  if (low > high) return;
  low = std::max(0.0, low - view.width / 12.0), high = std::min<double>(view.height, high + view.width / 12.0);
  if (high - low < 80) return;
  const Vec3 shift(0, (0.5 * (low + high) - 0.5 * view.height) / view.px_per_mm, 0);
  view.center += view.view_from_world.transpose() * shift;
  view.height = static_cast<int>(high - low);
}

}  // namespace

std::string overview(const Observation& seen, std::span<const Part> parts, const std::vector<Instance>& instances) {
  constexpr int kWidth = 1060;
  const Scan& scan = seen.scan;
  // The parallel view along the optical axis that shows what the camera saw at the scan's middle depth.
  std::vector<double> depths;
  for (const Vec3f& p : seen.surfels.position) depths.push_back(p.z());
  if (depths.empty()) return {};
  const double z = eval::quantile(depths, 0.5);
  const double px_per_mm = kWidth * scan.camera.fx / (z * scan.width());
  const int height = std::min(900, static_cast<int>(px_per_mm * z * scan.height() / scan.camera.fy));
  View view = view_along(Vec3::UnitZ(), Vec3::UnitY(), scan.camera.point(0.5 * scan.width(), 0.5 * scan.height(), z),
                         kWidth / px_per_mm, kWidth, height);
  keep_rows_with_parts(view, parts, instances);
  Canvas canvas(view);
  const Sighting all = whole_scan(scan, seen.surfels, seen.primitives);
  Image<std::uint8_t> found(scan.width(), scan.height(), 0);
  for (const Instance& instance : instances)
    for (const Part& part : parts) {
      if (part.name != instance.part) continue;
      const Sighting on = sighting_of(scan, seen.surfels, seen.primitives, part, instance.camera_from_part);
      for (std::size_t i = 0; i < found.size() && on.on_part.size() == found.size(); ++i)
        found.data[i] |= on.on_part.data[i];
    }
  canvas.draw(surface_of(scan, seen.surfels, all, std::max(1, scan.width() / 640),
                         [&](int u, int v) { return PixelLook{found(u, v) ? Material::grey : Material::faint}; }));
  const auto class_of = [&](const Instance& instance) {
    return static_cast<int>(
        std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; }) -
        parts.begin());
  };
  for (const Instance& instance : instances) {
    const int k = class_of(instance);
    if (k >= static_cast<int>(parts.size())) continue;
    Canvas hidden(view);
    hidden.draw(surface_of(parts[k].mesh, instance.camera_from_part, Material::grey));
    std::swap(hidden.depth, canvas.depth);
    Image<std::uint8_t> before = canvas.indices;
    draw_edges(canvas, parts[k].mesh, edges_of(parts[k].mesh), instance.camera_from_part, Material::class_line, 2.4,
               1.2);
    const std::uint8_t drawn = index_of(Material::class_line, 0.5), wanted = index_of(Material::height, 0.75, k % 6);
    for (std::size_t i = 0; i < before.size(); ++i)
      if (canvas.indices.data[i] == drawn && before.data[i] != drawn) canvas.indices.data[i] = wanted;
    std::swap(hidden.depth, canvas.depth);
  }
  return "<figure class=\"wide\"><div class=\"art\">" +
         painted(canvas, -1, "The scan with the outline of every part found") +
         "</div><figcaption>The scan from the camera's eye, with the CAD outline of every part found in its class's "
         "colour; what no part explains is pale, what was not measured is empty.</figcaption></figure>\n";
}

}  // namespace tribin::report
