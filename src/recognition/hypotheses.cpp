#include "hypotheses.hpp"

#include <algorithm>
#include <cmath>

namespace tribin {

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
    out.features.push_back(f);
  }
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
