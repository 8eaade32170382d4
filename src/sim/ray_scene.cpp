#include "sim/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>

#include "tribin/core/error.hpp"

namespace tribin::sim {
namespace {

// Rays leave a surface this far off [mm]: five times what float leaves of a point at 1 m and a chord of 0.02 mm.
constexpr double kOffSurface = 0.05;

}  // namespace

struct RayScene::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const std::vector<Body>* source = nullptr;
  std::vector<std::vector<Vec3>> vertices;  ///< of each body, camera frame
  std::vector<const Mesh*> meshes;

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

RayScene::RayScene(const std::vector<Body>& bodies) : state_(std::make_unique<State>()) {
  // A fixed instruction set and one building thread: the same tree, hence the same hits, on every machine.
  state_->device = rtcNewDevice("threads=1,isa=sse2");
  if (!state_->device) throw Error(ErrorCode::internal, "Embree gives no device with threads=1,isa=sse2");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Mesh& mesh = *bodies[b].mesh;
    std::vector<Vec3> points(mesh.vertices.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = bodies[b].camera_from_body * Vec3(mesh.vertices[i].cast<double>());
    const RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                          3 * sizeof(float), points.size()));
    auto* t = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                  3 * sizeof(std::uint32_t), mesh.triangles.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
      for (int k = 0; k < 3; ++k) v[3 * i + k] = static_cast<float>(points[i][k]);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (int k = 0; k < 3; ++k) t[3 * i + k] = mesh.triangles[i][k];
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(state_->scene, geometry, static_cast<unsigned>(b));
    rtcReleaseGeometry(geometry);
    state_->vertices.push_back(std::move(points));
    state_->meshes.push_back(&mesh);
  }
  rtcCommitScene(state_->scene);
}

RayScene::~RayScene() = default;

Hit RayScene::hit(const Vec3& origin, const Vec3& direction, double nearest) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(origin.x());
  query.ray.org_y = static_cast<float>(origin.y());
  query.ray.org_z = static_cast<float>(origin.z());
  query.ray.dir_x = static_cast<float>(direction.x());
  query.ray.dir_y = static_cast<float>(direction.y());
  query.ray.dir_z = static_cast<float>(direction.z());
  query.ray.tnear = static_cast<float>(nearest / direction.norm());
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.ray.mask = 0xFFFFFFFFu;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &query);
  Hit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.body = static_cast<int>(query.hit.geomID);
  hit.triangle = query.hit.primID;
  // The plane of the triangle in double: Embree's own distance is off by up to 0.1 um per metre and more at grazing.
  const auto& t = state_->meshes[hit.body]->triangles[hit.triangle];
  const auto& v = state_->vertices[hit.body];
  const Vec3 n = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]);
  const double along = n.dot(direction);
  hit.t = std::abs(along) > 1e-12 * n.norm() * direction.norm() ? n.dot(v[t[0]] - origin) / along : query.ray.tfar;
  hit.normal = (along > 0 ? Vec3(-n) : n).normalized();
  return hit;
}

Hit RayScene::first_hit(const Vec3& ray) const { return hit(Vec3::Zero(), ray, 1.0); }

Hit RayScene::next_hit(const Vec3& point, const Vec3& direction) const { return hit(point, direction, kOffSurface); }

bool RayScene::occluded(const Vec3& point, const Vec3& eye) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const Vec3 d = eye - point;
  RTCRay ray{};
  ray.org_x = static_cast<float>(point.x());
  ray.org_y = static_cast<float>(point.y());
  ray.org_z = static_cast<float>(point.z());
  ray.dir_x = static_cast<float>(d.x());
  ray.dir_y = static_cast<float>(d.y());
  ray.dir_z = static_cast<float>(d.z());
  ray.tnear = static_cast<float>(kOffSurface / d.norm());
  ray.tfar = 1.0f;
  ray.mask = 0xFFFFFFFFu;
  rtcOccluded1(state_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace tribin::sim
