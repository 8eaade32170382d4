#include "report/pictures.hpp"

#include <algorithm>
#include <cmath>

#include "report/html.hpp"
#include "report/links.hpp"
#include "report/shapes.hpp"
#include "report/solids.hpp"
#include "report/space_art.hpp"

namespace tribin::report {
namespace {

std::string figure(const std::string& letter, const std::string& caption, const std::string& art) {
  return "<figure><div class=\"art\">" + art + "</div><figcaption>" +
         (letter.empty() ? "" : "<b>" + letter + "</b>\u2002") + escaped(caption) + "</figcaption></figure>\n";
}

using RegionOf = std::function<Region(int id)>;

std::string painted(const Canvas& canvas, int part_class, const std::string& alt, const RegionOf& region_of = {}) {
  return picture(canvas.indices, palette(false, part_class), palette(true, part_class), alt) +
         (region_of ? region_layer(canvas.ids, region_of) : "");
}

std::string title_of(const Primitive& p, const std::string& of) {
  std::string out = std::string(name_of(p.type)) + " " + std::to_string(p.id) + " of the " + of;
  if (p.type != PrimitiveType::plane && p.type != PrimitiveType::cone)
    out += ", radius " + number(p.radius_mm, 2) + "\u2009mm";
  return out;
}

RegionOf regions_of_scan(const Primitives& primitives) {
  return [&](int id) {
    return Region{scan_key(id), title_of(primitives.items[static_cast<std::size_t>(id - 1)], "scan")};
  };
}

/// A primitive of the CAD carries the key of the one in the scan that was matched with it.
std::string key_of_cad(int id, const Instance* instance, int part_class) {
  if (instance)
    for (const Evidence& e : instance->evidence)
      if (e.cad_primitive == id && e.scan_primitive > 0) return scan_key(e.scan_primitive);
  return cad_key(part_class, id);
}

std::string space_figures(const Observation& seen, const Sighting& where, const std::string& of_what) {
  const SpaceArt art = space_art(seen, where);
  return figure("a", "IJK space: every normal of " + of_what + " as a point on the half sphere", art.all) +
         figure("b", "Dense spots of the flat surfels: candidates for planes", art.flat) +
         figure("c", "The curved surfels: a cylinder is a great circle, a cone a small one", art.curved) +
         figure("d", "Parameter space of the whole scan: votes for the axis (θ outwards, φ around), d = 0, log scale",
                art.votes);
}

std::string scan_figures(const Observation& seen, const Sighting& where, const View& view, int part_class) {
  const ScanCanvases drawn = scan_canvases(seen, where, view);
  return figure("e", "Scan, coloured by height over " + number(drawn.height_mm, 0) + " mm",
                painted(drawn.scan, part_class, "The scanned surface, coloured by height")) +
         figure("f", "Segmentation by type; grey is unexplained",
                painted(drawn.segmentation, part_class, "Segmentation by type", regions_of_scan(seen.primitives))) +
         figure("g", "Model observed in the scan: the fitted surfaces, trimmed to what was seen",
                painted(drawn.observed, part_class, "Fitted primitives", regions_of_scan(seen.primitives)));
}

std::string cad_figures(const Part& part, const Pose& pose, const View& view, const Instance* instance,
                        int part_class) {
  const CadCanvases drawn = cad_canvases(part, pose, view);
  const RegionOf region_of = [&](int id) {
    const auto& all = part.model.primitives;
    const auto at = std::find_if(all.begin(), all.end(), [&](const Primitive& p) { return p.id == id; });
    return at == all.end() ? Region{} : Region{key_of_cad(id, instance, part_class), title_of(*at, "CAD")};
  };
  return figure("h", "CAD as read: " + grouped(static_cast<long long>(part.mesh.triangles.size())) + " triangles",
                painted(drawn.cad, part_class, "The CAD part")) +
         figure("i", "Model made from the CAD, by the same segmentation",
                painted(drawn.model, part_class, "Primitives of the CAD part", region_of));
}

}  // namespace

std::string ten_pictures(const Observation& seen, const Part& part, const Instance* instance, int part_class,
                         int size_px) {
  if (!instance) return part_pictures(part, part_class, size_px);
  const Pose& pose = instance->camera_from_part;
  const Sighting where = sighting_of(seen.scan, seen.surfels, seen.primitives, part, pose);
  const View view = view_of(part.mesh.vertices, pose, size_px);
  return space_figures(seen, where, "this part") + scan_figures(seen, where, view, part_class) +
         cad_figures(part, pose, view, instance, part_class) +
         figure("j", "Pose: the CAD's outline on the scan",
                painted(pose_canvas(seen, where, part, pose, view), part_class, "CAD outline over the scan"));
}

std::string scan_pictures(const Observation& seen, int size_px) {
  const Sighting where = whole_scan(seen.scan, seen.surfels, seen.primitives);
  const View view = view_of(seen.surfels.position, Pose::Identity(), size_px);
  return space_figures(seen, where, "the scan") + scan_figures(seen, where, view, 0);
}

std::string cloud_pictures(const Surfels& surfels, const Primitives& primitives, int size_px) {
  Sighting all;
  for (std::uint32_t i = 0; i < surfels.size(); ++i) all.surfels.push_back(i);
  for (int k = 0; k < static_cast<int>(primitives.items.size()); ++k) all.primitives.push_back(k);
  // A square in the tangent plane of each surfel, a little larger than its share of the surface, so that they close.
  ShadedSurface squares;
  for (std::uint32_t i : all.surfels) {
    Vec3 u, v;
    orthonormal_basis(surfels.normal[i].cast<double>(), u, v);
    const float side = 0.75f * std::sqrt(surfels.area_mm2[i]);
    const Vec3f a = side * u.cast<float>(), b = side * v.cast<float>(), p = surfels.position[i];
    const auto first = static_cast<std::uint32_t>(squares.vertices.size());
    for (const Vec3f& corner : {Vec3f(p - a - b), Vec3f(p + a - b), Vec3f(p + a + b), Vec3f(p - a + b)})
      squares.vertices.push_back(corner);
    squares.triangles.push_back({first, first + 1, first + 2});
    squares.triangles.push_back({first, first + 2, first + 3});
    const int id = primitives.label_of_surfel[i];
    const Material material =
        id > 0 ? material_of(primitives.items[static_cast<std::size_t>(id - 1)].type) : Material::none;
    squares.materials.insert(squares.materials.end(), 2, material);
    squares.tints.insert(squares.tints.end(), 2, id > 0 ? tint_of(id) : 0.0f);
    squares.ids.insert(squares.ids.end(), 2, static_cast<std::uint16_t>(std::max(0, id)));
  }
  Canvas canvas(view_of(surfels.position, Pose::Identity(), size_px));
  canvas.draw(squares);
  const Scan none;  // the spaces are drawn from surfels alone
  return space_figures({none, surfels, primitives}, all, "the cloud") +
         figure("f", "Segmentation by type; grey is unexplained",
                painted(canvas, 0, "Segmentation by type", regions_of_scan(primitives)));
}

std::string part_pictures(const Part& part, int part_class, int size_px) {
  Pose pose = Pose::Identity();  // from the front, above: the part's z upwards
  pose.linear() = rotation_from_vector(Vec3(90 * kDegree, 0, 0));
  pose.linear() = rotation_from_vector(Vec3(0, 0, 30 * kDegree)) * pose.linear();
  pose.translation() = Vec3(0, 0, 10 * part.diameter_mm) - pose.linear() * part.box_center();
  return cad_figures(part, pose, view_of(part.mesh.vertices, pose, size_px), nullptr, part_class);
}

std::string picture_legend() {
  std::string out = "<div class=\"leg\">";
  for (PrimitiveType type : {PrimitiveType::plane, PrimitiveType::cylinder, PrimitiveType::cone, PrimitiveType::sphere,
                             PrimitiveType::torus})
    out += "<span>" + type_icon(type) + name_of(type) + "</span>";
  out +=
      "<span>low <i class=\"ramp viridis\"></i> high (viridis)</span><span>few <i class=\"ramp magma\"></i> many "
      "(magma)</span>";
  return out + "</div>\n";
}

}  // namespace tribin::report
