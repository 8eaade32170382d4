#include "part/surface_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "tribin/cad/half_edges.hpp"
#include "tribin/cad/nearest.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

// Facets that meet under more than this are an edge of the part. It is the default angular deflection of Open CASCADE's
// mesher, the coarsest that is common: a hexagonal prism (60 deg) keeps its edges, a round of 13 facets is a round.
constexpr double kSmoothAngle = 0.5;
// Below this an angle between facets is the rounding of float vertices, not a bend.
constexpr double kFlatAngle = 0.2 * kDegree;
// Two facetings of one curved surface lie at most one sagitta apart; half more for the estimate of the sagitta.
constexpr double kSagittaFactor = 1.5;
// A lone bend between two large plates looks like a coarse round; whatever it claims, it blurs no more than this.
constexpr double kLargestSlack = 0.015;  // of the diameter
constexpr double kSameFacet = 4;         // ratio of widths
constexpr int kLeafSize = 4;

}  // namespace

SurfaceIndex::SurfaceIndex(const Mesh& mesh) : oriented_(mesh.oriented) {
  std::vector<int> kept;
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    Triangle triangle;
    triangle.a = mesh.vertices[t[0]].cast<double>();
    triangle.ab = mesh.vertices[t[1]].cast<double>() - triangle.a;
    triangle.ac = mesh.vertices[t[2]].cast<double>() - triangle.a;
    const Vec3 cross = triangle.ab.cross(triangle.ac);
    const double longest = std::max({triangle.ab.squaredNorm(), triangle.ac.squaredNorm(), 1e-300});
    if (!(cross.norm() > 1e-7 * longest)) continue;  // a sliver: no area, and no normal to trust
    triangle.area = 0.5 * cross.norm();
    triangle.normal = cross.normalized();
    area_mm2_ += triangle.area;
    moment += triangle.area * (triangle.a + (triangle.ab + triangle.ac) / 3);
    triangles_.push_back(triangle);
    kept.push_back(static_cast<int>(i));
  }
  if (!(area_mm2_ > 0))
    throw Error(ErrorCode::too_little_data,
                "mesh '" + mesh.name + "': has no triangle with area; its symmetry needs some");
  centroid_ = moment / area_mm2_;
  for (const Triangle& t : triangles_) {
    // Second moment of a triangle about the centroid: area/12 (sum over corners + 9 times the one of the middle).
    const Vec3 a = t.a - centroid_, b = a + t.ab, c = a + t.ac, m = (a + b + c) / 3;
    covariance_ += t.area / 12 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + 9 * m * m.transpose());
  }
  covariance_ /= area_mm2_;
  // Farthest from the middle, farthest from that, and so on: the largest distance of two corners, but for odd shapes.
  Vec3 from = centroid_;
  for (int sweep = 0; sweep < 5; ++sweep) {
    Vec3 farthest = from;
    for (const Triangle& t : triangles_)
      for (const Vec3& p : {t.a, Vec3(t.a + t.ab), Vec3(t.a + t.ac)})
        if ((p - from).squaredNorm() > (farthest - from).squaredNorm()) farthest = p;
    if (sweep > 0) diameter_mm_ = std::max(diameter_mm_, (farthest - from).norm());
    from = farthest;
  }
  measure_facets(mesh, kept);
  build_nodes();
}

/// Finds for each facet how much the surface that it stands for may bulge from it, by the angles to its neighbours.
void SurfaceIndex::measure_facets(const Mesh& mesh, const std::vector<int>& kept) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const int k : kept) triangles.push_back(mesh.triangles[static_cast<std::size_t>(k)]);
  std::vector<float> slack_of_vertex(mesh.vertices.size(), 0);
  const double least = mesh.chord_error_mm, most = kLargestSlack * diameter_mm_;
  const auto bend = [&](const HalfEdge& e, const HalfEdge& f) {
    Triangle &s = triangles_[e.triangle], &t = triangles_[f.triangle];
    const double angle = std::atan2(s.normal.cross(t.normal).norm(), s.normal.dot(t.normal));
    if (angle < kFlatAngle || angle > kSmoothAngle) return;
    const double length = (mesh.vertices[e.low] - mesh.vertices[e.high]).cast<double>().norm();
    const double narrow = 2 * std::min(s.area, t.area) / std::max(length, 1e-12);
    const double wide = 2 * std::max(s.area, t.area) / std::max(length, 1e-12);
    // The triangles of a cone's facet have its narrow and its wide end; beside a round, a wide one is the flat face.
    const double width = wide < kSameFacet * narrow ? wide : narrow;
    // A chord of length w that turns by the angle has the radius w / angle and the sagitta w^2 / (8 r).
    const double slack = std::min(most, kSagittaFactor * std::max(least, width * angle / 8));
    s.bend = std::max(s.bend, angle);
    t.bend = std::max(t.bend, angle);
    for (const auto v : {e.low, e.high}) slack_of_vertex[v] = std::max(slack_of_vertex[v], static_cast<float>(slack));
  };
  for_each_edge(sorted_half_edges(triangles), [&](std::span<const HalfEdge> edge) {
    for (std::size_t i = 0; i + 1 < edge.size(); ++i) bend(edge[i], edge[i + 1]);
  });
  // By way of the vertices, so that the flat face beside a round, whose rim is cut by the same chords, gets it too.
  for (std::size_t i = 0; i < kept.size(); ++i)
    for (const auto v : mesh.triangles[kept[i]])
      triangles_[i].slack_mm = std::max<double>(triangles_[i].slack_mm, slack_of_vertex[v]);
}

void SurfaceIndex::build_nodes() {
  const int count = static_cast<int>(triangles_.size());
  std::vector<Vec3f> middle(count);
  for (int i = 0; i < count; ++i) {
    const Triangle& t = triangles_[i];
    middle[i] = (t.a + (t.ab + t.ac) / 3).cast<float>();
  }
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(count);
  nodes_.push_back({{}, {}, {}, {}, 0, count});
  for (std::size_t at = 0; at < nodes_.size(); ++at) {
    const int first = nodes_[at].first, size = nodes_[at].count;
    Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max()), high = -low, middle_low = low, middle_high = high,
          normal_low = low, normal_high = high;
    for (int i = first; i < first + size; ++i) {
      const Triangle& t = triangles_[order[i]];
      for (const Vec3& p : {t.a, Vec3(t.a + t.ab), Vec3(t.a + t.ac)}) {
        low = low.cwiseMin(p.cast<float>());
        high = high.cwiseMax(p.cast<float>());
      }
      normal_low = normal_low.cwiseMin(t.normal.cast<float>());
      normal_high = normal_high.cwiseMax(t.normal.cast<float>());
      middle_low = middle_low.cwiseMin(middle[order[i]]);
      middle_high = middle_high.cwiseMax(middle[order[i]]);
    }
    for (int k = 0; k < 3; ++k) {
      nodes_[at].low[k] = low[k];
      nodes_[at].high[k] = high[k];
      nodes_[at].normal_low[k] = normal_low[k];
      nodes_[at].normal_high[k] = normal_high[k];
    }
    if (size <= kLeafSize) continue;
    int axis = 0;
    (middle_high - middle_low).maxCoeff(&axis);
    const int half = first + size / 2;
    std::nth_element(order.begin() + first, order.begin() + half, order.begin() + first + size, [&](int i, int j) {
      return middle[i][axis] != middle[j][axis] ? middle[i][axis] < middle[j][axis] : i < j;
    });
    nodes_[at].first = static_cast<int>(nodes_.size());
    nodes_[at].count = 0;
    nodes_.push_back({{}, {}, {}, {}, first, half - first});
    nodes_.push_back({{}, {}, {}, {}, half, first + size - half});
  }
  std::vector<Triangle> sorted(count);
  for (int i = 0; i < count; ++i) sorted[i] = triangles_[order[i]];
  triangles_.swap(sorted);
}

/// Calls visit(triangle index) -> squared radius to go on with (negative: stop), nearer boxes first.
template <class Visit>
void SurfaceIndex::visit_within(const Vec3& p, const Vec3& n, double radius_mm, double min_cos, Visit&& visit) const {
  const float x = static_cast<float>(p.x()), y = static_cast<float>(p.y()), z = static_cast<float>(p.z());
  const auto squared_distance = [x, y, z](const Node& node) {
    const float dx = std::max(std::max(node.low[0] - x, x - node.high[0]), 0.0f);
    const float dy = std::max(std::max(node.low[1] - y, y - node.high[1]), 0.0f);
    const float dz = std::max(std::max(node.low[2] - z, z - node.high[2]), 0.0f);
    return dx * dx + dy * dy + dz * dz;
  };
  const float nx = static_cast<float>(n.x()), ny = static_cast<float>(n.y()), nz = static_cast<float>(n.z());
  const float least_cos = static_cast<float>(min_cos) - 1e-5f;
  const auto may_face = [&](const Node& node) {
    const float highest = std::max(nx * node.normal_low[0], nx * node.normal_high[0]) +
                          std::max(ny * node.normal_low[1], ny * node.normal_high[1]) +
                          std::max(nz * node.normal_low[2], nz * node.normal_high[2]);
    if (highest >= least_cos || oriented_) return highest >= least_cos;
    const float lowest = std::min(nx * node.normal_low[0], nx * node.normal_high[0]) +
                         std::min(ny * node.normal_low[1], ny * node.normal_high[1]) +
                         std::min(nz * node.normal_low[2], nz * node.normal_high[2]);
    return -lowest >= least_cos;
  };
  double limit = radius_mm * radius_mm;
  struct Entry {
    std::int32_t node;
    float squared;
  };
  std::array<Entry, 64> stack;  // the tree is balanced: its depth is log2 of the number of triangles
  int top = 0;
  if (const float d = squared_distance(nodes_[0]); d <= limit) stack[top++] = {0, d};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.squared > limit) continue;
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      for (int i = node.first; i < node.first + node.count; ++i) {
        limit = visit(i, limit);
        if (limit < 0) return;
      }
      continue;
    }
    Entry near{node.first, squared_distance(nodes_[node.first])};
    Entry far{node.first + 1, squared_distance(nodes_[node.first + 1])};
    if (far.squared < near.squared) std::swap(near, far);
    if (far.squared <= limit && may_face(nodes_[far.node])) stack[top++] = far;
    if (near.squared <= limit && may_face(nodes_[near.node])) stack[top++] = near;
  }
}

bool SurfaceIndex::has_near(const Vec3& p, const Vec3& n, double radius_mm, double min_cos) const {
  bool found = false;
  visit_within(p, n, radius_mm, min_cos, [&](int i, double limit) {
    const Triangle& t = triangles_[i];
    const double cosine = t.normal.dot(n);
    if ((oriented_ ? cosine : std::abs(cosine)) < min_cos) return limit;
    const double off_plane = t.normal.dot(p - t.a);
    if (off_plane * off_plane > limit) return limit;
    if ((p - nearest_on_triangle(t.a, t.ab, t.ac, p)).squaredNorm() > limit) return limit;
    found = true;
    return -1.0;
  });
  return found;
}

SurfaceHit SurfaceIndex::nearest(const Vec3& p, const Vec3& n, double radius_mm, double min_cos) const {
  SurfaceHit hit;
  visit_within(p, n, radius_mm, min_cos, [&](int i, double limit) {
    const Triangle& t = triangles_[i];
    const double cosine = t.normal.dot(n);
    if ((oriented_ ? cosine : std::abs(cosine)) < min_cos) return limit;
    const double off_plane = t.normal.dot(p - t.a);
    if (off_plane * off_plane > limit) return limit;
    const Vec3 q = nearest_on_triangle(t.a, t.ab, t.ac, p);
    const double squared = (p - q).squaredNorm();
    if (squared > limit || (hit.triangle >= 0 && squared == limit)) return limit;
    hit = {i, q, std::sqrt(squared)};
    return squared;
  });
  return hit;
}

std::vector<SurfaceSample> SurfaceIndex::sample(int count) const {
  std::vector<double> until(triangles_.size());
  double sum = 0;
  for (std::size_t i = 0; i < triangles_.size(); ++i) until[i] = sum += triangles_[i].area;
  // R3 of Roberts, "The unreasonable effectiveness of quasirandom sequences": powers of the root of x^4 = x + 1.
  constexpr double kRoot = 1.2207440846057596;
  constexpr std::array<double, 3> kStep = {1 / kRoot, 1 / (kRoot * kRoot), 1 / (kRoot * kRoot * kRoot)};
  std::vector<SurfaceSample> samples(count);
  for (int i = 0; i < count; ++i) {
    std::array<double, 3> r;
    for (int k = 0; k < 3; ++k) {
      const double x = 0.5 + (i + 1) * kStep[k];
      r[k] = x - std::floor(x);
    }
    const auto it = std::upper_bound(until.begin(), until.end(), r[0] * sum);
    const Triangle& t = triangles_[std::min<std::size_t>(it - until.begin(), triangles_.size() - 1)];
    if (r[1] + r[2] > 1) r[1] = 1 - r[1], r[2] = 1 - r[2];
    samples[i] = {t.a + r[1] * t.ab + r[2] * t.ac, t.normal, t.slack_mm, t.bend};
  }
  return samples;
}

}  // namespace tribin
