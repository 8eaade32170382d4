#include "tribin/sim/stable_rests.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "sim/convex_hull.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"

namespace tribin::sim {
namespace {

constexpr double kCoplanar = 0.05 * kDegree;  // a wobble of 0.1 mm under a part of 100 mm: no one sees it
constexpr double kSameRest = 10 * kDegree;    // facets of a rounded side: lying on the next is the same rest
constexpr double kLeastMargin = 0.003;        // of the diameter: less than that, a touch turns the part over
constexpr double kLeastProbability = 0.005;   // a rest that one throw of 200 finds, at best

/// A flat support: hull faces of one plane, n . x <= offset for all of the part.
struct Support {
  Vec3 normal = Vec3::Zero();
  double offset = 0;
  std::vector<int> vertices;
};

/// Normal of a polygon times twice its area (Newell): outward for faces wound counter-clockwise.
Vec3 area_vector(const std::vector<Vec3>& points, const std::vector<int>& face) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < face.size(); ++i)
    sum += (points[face[i]] - points[face[0]]).cross(points[face[(i + 1) % face.size()]] - points[face[0]]);
  return sum;
}

std::vector<Support> supports_of(const std::vector<Vec3>& points, const Vec3& inside) {
  std::vector<std::vector<int>> faces = convex_hull(points);
  std::stable_sort(faces.begin(), faces.end(), [&](const auto& a, const auto& b) {
    return area_vector(points, a).norm() > area_vector(points, b).norm();
  });
  std::vector<Support> supports;
  for (const std::vector<int>& face : faces) {
    const Vec3 area = area_vector(points, face);
    if (area.norm() < 1e-3) continue;  // mm^2: a sliver bears nothing and has no direction
    Vec3 normal = area.normalized();
    if (normal.dot(points[face[0]] - inside) < 0) normal = -normal;
    const auto same = std::find_if(supports.begin(), supports.end(), [&](const Support& s) {
      return s.normal.dot(normal) > std::cos(kCoplanar) && std::abs(s.normal.dot(points[face[0]]) - s.offset) < 0.1;
    });
    if (same == supports.end()) {
      double offset = -1e300;
      for (const Vec3& p : points) offset = std::max(offset, normal.dot(p));
      supports.push_back({normal, offset, face});
    } else {
      same->vertices.insert(same->vertices.end(), face.begin(), face.end());
    }
  }
  return supports;
}

/// The part turned so that the support lies in z = 0, the centre of mass above the origin.
Pose resting(const Support& s, const Vec3& centre) {
  Vec3 u, v;
  orthonormal_basis(-s.normal, u, v);  // the table's z is against the support's outward normal
  Pose pose = Pose::Identity();
  pose.linear().row(0) = u;
  pose.linear().row(1) = v;
  pose.linear().row(2) = -s.normal;
  pose.translation() = -(pose.linear() * centre);
  pose.translation().z() = s.offset;
  return pose;
}

/// Convex outline of points in the plane, counter-clockwise (monotone chain).
std::vector<Vec2> outline(std::vector<Vec2> p) {
  std::sort(p.begin(), p.end(),
            [](const Vec2& a, const Vec2& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  const auto left = [](const Vec2& a, const Vec2& b, const Vec2& c) {
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()) > 0;
  };
  std::vector<Vec2> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Vec2& q : p) {
      while (hull.size() >= start + 2 && !left(hull[hull.size() - 2], hull.back(), q)) hull.pop_back();
      hull.push_back(q);
    }
    hull.pop_back();
    std::reverse(p.begin(), p.end());
  }
  return hull;
}

/// Distance of the origin from the nearest side, negative outside.
double margin_of(const std::vector<Vec2>& polygon) {
  double margin = 1e300;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Vec2 d = b - a;
    if (d.norm() > 0) margin = std::min(margin, (a.x() * b.y() - a.y() * b.x()) / d.norm());
  }
  return polygon.size() < 3 ? -1 : margin;
}

/// Solid angle of the polygon at the height h below the eye, which stands above the origin.
double solid_angle(const std::vector<Vec2>& polygon, double h) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const Vec3 a(p.x(), p.y(), -h), b(q.x(), q.y(), -h), c(0, 0, -h);  // Van Oosterom and Strackee, 1983
    const double la = a.norm(), lb = b.norm();
    sum += 2 * std::atan2(std::abs(a.dot(b.cross(c))), la * lb * h + a.dot(b) * h + b.dot(c) * la + a.dot(c) * lb);
  }
  return sum;
}

}  // namespace

Vec3 centre_of_mass(const Mesh& mesh) {
  double volume = 0;
  Vec3 moment = Vec3::Zero();
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
               c = mesh.vertices[t[2]].cast<double>();
    const double v = a.dot(b.cross(c)) / 6;
    volume += v;
    moment += v * (a + b + c) / 4;
  }
  if (!(std::abs(volume) > 1e-6))
    throw Error(ErrorCode::too_little_data, mesh.name + ": the mesh encloses no volume, so it has no centre of mass");
  return moment / volume;
}

std::vector<StableRest> stable_rests(const Mesh& mesh) {
  const Vec3 centre = centre_of_mass(mesh);
  std::vector<Vec3> points;
  for (const Vec3f& v : mesh.vertices) points.push_back(v.cast<double>());
  const std::vector<Support> supports = supports_of(points, centre);
  std::vector<StableRest> rests;
  for (const Support& s : supports) {
    StableRest rest;
    rest.table_from_part = resting(s, centre);
    std::vector<Vec2> foot;
    for (const int i : s.vertices) {
      const Vec3 p = rest.table_from_part * points[i];
      foot.push_back({p.x(), p.y()});
    }
    const std::vector<Vec2> polygon = outline(foot);
    rest.margin_mm = margin_of(polygon);
    const double height = (rest.table_from_part * centre).z();
    if (rest.margin_mm <= 0 || height <= 0) continue;
    rest.probability = solid_angle(polygon, height);
    rests.push_back(rest);
  }
  std::stable_sort(rests.begin(), rests.end(),
                   [](const StableRest& a, const StableRest& b) { return a.probability > b.probability; });
  // Facets of a rounded side are one rest: the one that is most likely, with the probability of all.
  std::vector<StableRest> merged;
  for (const StableRest& rest : rests) {
    const Vec3 up = rest.table_from_part.linear().row(2).transpose();  // the table's z, in the part
    const auto same = std::find_if(merged.begin(), merged.end(), [&](const StableRest& m) {
      return up.dot(Vec3(m.table_from_part.linear().row(2).transpose())) > std::cos(kSameRest);
    });
    if (same == merged.end()) {
      merged.push_back(rest);
    } else {
      same->probability += rest.probability;
    }
  }
  double total = 0;
  for (const StableRest& rest : merged) total += rest.probability;
  const double least_margin = kLeastMargin * diameter(mesh.vertices);
  std::vector<StableRest> kept;
  std::copy_if(merged.begin(), merged.end(), std::back_inserter(kept), [&](const StableRest& rest) {
    return rest.margin_mm >= least_margin && rest.probability >= kLeastProbability * total;
  });
  if (kept.empty()) kept = merged;  // a ball, a long round bar: it lies on some facet
  if (kept.empty()) throw Error(ErrorCode::too_little_data, mesh.name + ": the part lies still on no side");
  std::stable_sort(kept.begin(), kept.end(),
                   [](const StableRest& a, const StableRest& b) { return a.probability > b.probability; });
  total = 0;
  for (const StableRest& rest : kept) total += rest.probability;
  for (StableRest& rest : kept) rest.probability /= total;
  return kept;
}

}  // namespace tribin::sim
