#include "hypotheses.hpp"

#include <algorithm>
#include <cmath>

namespace tribin {

namespace {

/// The surfels of a plane that are extreme in directions every 22.5 deg.
std::vector<Vec3f> ends_of(const Primitive& plane, const Surfels& surfels) {
  Vec3 u, v;
  orthonormal_basis(plane.axis, u, v);
  std::vector<Vec3f> out;
  constexpr int kDirections = 8;
  for (int k = 0; k < kDirections; ++k) {
    const double a = kPi * k / kDirections;
    const Vec3f d = (u * std::cos(a) + v * std::sin(a)).cast<float>();
    const auto [low, high] = std::minmax_element(
        plane.surfels.begin(), plane.surfels.end(),
        [&](std::uint32_t s, std::uint32_t t) { return surfels.position[s].dot(d) < surfels.position[t].dot(d); });
    if (low == plane.surfels.end()) break;
    out.push_back(surfels.position[*low]);
    out.push_back(surfels.position[*high]);
  }
  return out;
}

/// Planes grow over cells beside them that no primitive has: their normals are spoiled by noise or by an edge, but they
/// lie in the plane within three sigma of one pixel.
Image<std::int32_t> label_cells(const SceneFeatures& scene) {
  const Surfels& surfels = *scene.surfels;
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  Image<std::int32_t> out(grid.width, grid.height, 0);
  std::vector<const Primitive*> plane(scene.primitives->items.size() + 1, nullptr);
  for (const SceneFeature& f : scene.features)
    if (f.primitive->type == PrimitiveType::plane) plane[static_cast<std::size_t>(f.primitive->id)] = f.primitive;
  constexpr double kSigmas = 3;  // of one pixel: what pixels have in common no mean over a cell takes away
  std::vector<std::size_t> border;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    if (grid.data[i] < 0) continue;
    out.data[i] = scene.primitives->label_of_surfel[static_cast<std::size_t>(grid.data[i])];
    if (plane[static_cast<std::size_t>(out.data[i])] != nullptr) border.push_back(i);
  }
  for (std::size_t next = 0; next < border.size(); ++next) {
    const std::int32_t id = out.data[border[next]];
    const Primitive& p = *plane[static_cast<std::size_t>(id)];
    const int x = static_cast<int>(border[next]) % grid.width, y = static_cast<int>(border[next]) / grid.width;
    for (const auto& [i, j] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
      if (!grid.contains(i, j) || grid(i, j) < 0 || out(i, j) != 0) continue;
      const Vec3 point = surfels.position[static_cast<std::size_t>(grid(i, j))].cast<double>();
      if (std::abs(p.axis.dot(point) - p.offset_mm) > kSigmas * local_sigma_mm(surfels, grid.index(i, j))) continue;
      out(i, j) = id;
      border.push_back(grid.index(i, j));
    }
  }
  return out;
}

}  // namespace

double local_sigma_mm(const Surfels& surfels, std::size_t cell) {
  const Image<float>& tiles = surfels.local_sigma_mm;
  const int i = static_cast<int>(cell) % surfels.surfel_of_cell.width,
            j = static_cast<int>(cell) / surfels.surfel_of_cell.width;
  return tiles(std::min(i / 8, tiles.width - 1), std::min(j / 8, tiles.height - 1));
}

SceneFeatures make_scene_features(const Primitives& primitives, const PrimitiveModel& observation,
                                  const Surfels& surfels) {
  SceneFeatures out;
  out.surfels = &surfels;
  out.primitives = &primitives;
  for (const Primitive& p : observation.primitives) {
    SceneFeature f;
    f.primitive = &p;
    double area = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::uint32_t s : p.surfels) {
      area += surfels.area_mm2[s];
      sum += surfels.area_mm2[s] * surfels.position[s].cast<double>();
    }
    if (area > 0) f.centroid = sum / area;
    for (const std::uint32_t s : p.surfels)
      f.reach_mm = std::max(f.reach_mm, (surfels.position[s].cast<double>() - f.centroid).norm());
    if (p.type == PrimitiveType::plane) f.ends = ends_of(p, surfels);
    out.features.push_back(f);
  }
  out.label_of_cell = label_cells(out);
  return out;
}

namespace {

/// A feature of which more than half is explained starts nothing new.
template <typename Explains>
void drop_features(SceneFeatures& scene, const Explains& explains) {
  std::erase_if(scene.features, [&](const SceneFeature& f) {
    std::size_t inside = 0;
    for (const std::uint32_t s : f.primitive->surfels) inside += explains(scene.surfels->cell[s]);
    return 2 * inside > f.primitive->surfels.size();
  });
}

}  // namespace

void claim_cells(SceneFeatures& scene, const CellMask& mask) {
  scene.claimed.join(mask);
  drop_features(scene, [&](std::uint32_t cell) { return scene.claimed.holds(cell); });
}

SceneFeatures foreground(const SceneFeatures& scene, const Image<std::uint8_t>& background) {
  SceneFeatures out = scene;
  drop_features(out, [&](std::uint32_t cell) { return background.data[cell] != 0; });
  return out;
}

bool SceneFeatures::changed_near(const Vec3f& point, double reach_mm) const {
  const auto square = static_cast<float>(reach_mm * reach_mm);
  return !fresh ||
         std::any_of(fresh->begin(), fresh->end(), [&](const Vec3f& p) { return (p - point).squaredNorm() < square; });
}

std::vector<Vec3f> points_of(const CellMask& mask, const Surfels& surfels) {
  const int every = mask.count < 1000 ? 1 : 4;  // a small part must not fall between
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  std::vector<Vec3f> out;
  for (int j = 0; j < grid.height; j += every)
    for (int i = 0; i < grid.width; i += every)
      if (mask.holds(grid.index(i, j)) && grid(i, j) >= 0)
        out.push_back(surfels.position[static_cast<std::size_t>(grid(i, j))]);
  return out;
}

std::vector<PartFeature> visible_features(const Part& part, PrimitiveType type, std::size_t most) {
  std::vector<PartFeature> out;
  double total = 0;
  for (const double e : part.exposed_mm2) total += e;
  for (std::size_t i = 0; i < part.model.primitives.size(); ++i) {
    const Primitive& p = part.model.primitives[i];
    // Less than 0.5 % of what is seen of the part: a chamfer, the flank of a screw thread. Too small to start from.
    if (p.type != type || part.exposed_mm2[i] < 0.005 * total) continue;
    PartFeature f;
    f.primitive = &p;
    f.exposed_mm2 = part.exposed_mm2[i];
    for (const std::uint32_t t : p.surfels)
      for (const std::uint32_t v : part.mesh.triangles[t])
        f.reach_mm = std::max(f.reach_mm, (part.mesh.vertices[v].cast<double>() - p.point).norm());
    out.push_back(f);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const PartFeature& a, const PartFeature& b) { return a.exposed_mm2 > b.exposed_mm2; });
  if (out.size() > most) out.resize(most);
  return out;
}

Matrix3 rotation_from_directions(const Vec3& x_part, const Vec3& y_part, const Vec3& x_camera, const Vec3& y_camera) {
  const auto frame = [](const Vec3& x, const Vec3& y) {
    const Eigen::Vector3d a = Eigen::Vector3d(x).normalized();
    const Eigen::Vector3d c = a.cross(Eigen::Vector3d(y)).normalized();
    Eigen::Matrix3d m;
    m.col(0) = a;
    m.col(1) = c.cross(a);
    m.col(2) = c;
    return m;
  };
  return frame(x_camera, y_camera) * frame(x_part, y_part).transpose();
}

Pose pose_from(const Matrix3& rotation, const Vec3& part_point, const Vec3& camera_point) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = camera_point - rotation * part_point;
  return pose;
}

}  // namespace tribin
