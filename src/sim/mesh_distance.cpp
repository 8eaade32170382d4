#include "sim/mesh_distance.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tribin/core/error.hpp"

namespace tribin::sim {
namespace {

struct Edge {
  std::uint32_t a, b;  ///< a < b
  std::uint32_t triangle;
  int side;  ///< from corner `side` to the next
};

/// The nearest point of a triangle, and on what of it the point lies.
struct Nearest {
  Vec3 point;
  int corner = -1;  ///< 0..2, on that corner
  int side = -1;    ///< 0..2, on the side from that corner to the next; both -1: inside
};

/// \source Ericson, Real-Time Collision Detection, 5.1.5.
Nearest nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, 0, -1};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, 1, -1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + ab * (d1 / (d1 - d3)), -1, 0};
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, 2, -1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + ac * (d2 / (d2 - d6)), -1, 2};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return {b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), -1, 1};
  const double sum = va + vb + vc;
  return {a + ab * (vb / sum) + ac * (vc / sum), -1, -1};
}

}  // namespace

struct MeshDistance::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const Mesh* mesh = nullptr;
  std::vector<Vec3> at_vertex;               ///< angle-weighted normal
  std::vector<Vec3> at_face;                 ///< unit normal
  std::vector<std::array<Vec3, 3>> at_side;  ///< sum of both faces' normals

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  Vec3 vertex(std::uint32_t triangle, int corner) const {
    return mesh->vertices[mesh->triangles[triangle][corner]].cast<double>();
  }
};

namespace {

/// What a query carries through Embree's callback.
struct Query {
  const Mesh* mesh;
  Vec3 point;
  double best2;  ///< squared distance
  std::uint32_t triangle = 0;
  Nearest nearest;
  bool found = false;
};

bool visit(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<Query*>(args->userPtr);
  const auto& t = q.mesh->triangles[args->primID];
  const Nearest n = nearest_on_triangle(q.point, q.mesh->vertices[t[0]].cast<double>(),
                                        q.mesh->vertices[t[1]].cast<double>(), q.mesh->vertices[t[2]].cast<double>());
  const double d2 = (q.point - n.point).squaredNorm();
  // Equal distances (a shared edge): the lower triangle, whatever the order of the tree.
  if (d2 > q.best2 || (d2 == q.best2 && q.found && args->primID > q.triangle)) return false;
  q.best2 = d2;
  q.triangle = args->primID;
  q.nearest = n;
  q.found = true;
  args->query->radius = static_cast<float>(std::sqrt(d2) * (1 + 1e-6));
  return true;
}

}  // namespace

MeshDistance::MeshDistance(const Mesh& mesh) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.mesh = &mesh;
  s.device = rtcNewDevice("threads=1,isa=sse2");
  if (!s.device) throw Error(ErrorCode::internal, "Embree gives no device with threads=1,isa=sse2");
  s.scene = rtcNewScene(s.device);
  const RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                        3 * sizeof(float), mesh.vertices.size()));
  auto* t = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                3 * sizeof(std::uint32_t), mesh.triangles.size()));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    for (int k = 0; k < 3; ++k) v[3 * i + k] = mesh.vertices[i][k];
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) t[3 * i + k] = mesh.triangles[i][k];
  rtcSetGeometryPointQueryFunction(geometry, visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(s.scene, geometry, 0);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(s.scene);

  const std::size_t n = mesh.triangles.size();
  s.at_face.resize(n);
  s.at_side.resize(n);
  s.at_vertex.assign(mesh.vertices.size(), Vec3::Zero());
  std::vector<Edge> edges;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::array<Vec3, 3> p = {s.vertex(i, 0), s.vertex(i, 1), s.vertex(i, 2)};
    const Vec3 area = (p[1] - p[0]).cross(p[2] - p[0]);
    s.at_face[i] = area.norm() > 0 ? Vec3(area.normalized()) : Vec3(Vec3::Zero());
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = p[(k + 1) % 3] - p[k], w = p[(k + 2) % 3] - p[k];
      const std::uint32_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
      s.at_vertex[a] += std::atan2(u.cross(w).norm(), u.dot(w)) * s.at_face[i];
      edges.push_back({std::min(a, b), std::max(a, b), i, k});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return std::tie(x.a, x.b, x.triangle) < std::tie(y.a, y.b, y.triangle);
  });
  for (std::size_t i = 0, j; i < edges.size(); i = j) {
    Vec3 sum = Vec3::Zero();
    for (j = i; j < edges.size() && edges[j].a == edges[i].a && edges[j].b == edges[i].b; ++j)
      sum += s.at_face[edges[j].triangle];
    for (std::size_t k = i; k < j; ++k) s.at_side[edges[k].triangle][edges[k].side] = sum;
  }
}

MeshDistance::~MeshDistance() = default;

double MeshDistance::signed_distance(const Vec3& point, double limit) const {
  RTCPointQuery query{};
  query.x = static_cast<float>(point.x());
  query.y = static_cast<float>(point.y());
  query.z = static_cast<float>(point.z());
  query.radius = static_cast<float>(limit);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  Query q{state_->mesh, point, limit * limit, 0, {}, false};
  rtcPointQuery(state_->scene, &query, &context, nullptr, &q);
  if (!q.found) return limit;
  const Vec3& normal = q.nearest.corner >= 0 ? state_->at_vertex[state_->mesh->triangles[q.triangle][q.nearest.corner]]
                       : q.nearest.side >= 0 ? state_->at_side[q.triangle][q.nearest.side]
                                             : state_->at_face[q.triangle];
  const double distance = std::sqrt(q.best2);
  return normal.dot(point - q.nearest.point) < 0 ? -distance : distance;
}

}  // namespace tribin::sim
