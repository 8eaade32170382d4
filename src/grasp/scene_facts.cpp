#include "scene_facts.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "bin_space.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

// Columns are as wide as the blocks of a scan.
constexpr double kCell_mm = 3;
// What lies that much higher than a part's own surface is something else: noise, pose and models err by less.
constexpr double kAbove_mm = 4;
// A point is within another part's hull where it lies deeper than poses err.
constexpr double kWithin_mm = 3;

void validate(const PlanOptions& o) {
  const auto must = [](bool good, const char* name, double seen, const char* wanted) {
    if (!good)
      throw Error(ErrorCode::bad_option,
                  std::string(name) + ": saw " + std::to_string(seen) + ", wanted a number in " + wanted);
  };
  must(!o.max_tilt_rad || (*o.max_tilt_rad >= 0 && *o.max_tilt_rad <= kPi), "max_tilt_rad", o.max_tilt_rad.value_or(0),
       "[0, pi]");
  must(o.approach_mm > 0 && o.approach_mm <= 1000, "approach_mm", o.approach_mm, "(0, 1000]");
  must(o.retreat_mm > 0 && o.retreat_mm <= 1000, "retreat_mm", o.retreat_mm, "(0, 1000]");
  must(o.clearance_mm >= 0 && o.clearance_mm <= 100, "clearance_mm", o.clearance_mm, "[0, 100]");
  must(o.min_score >= 0 && o.min_score <= 1, "min_score", o.min_score, "[0, 1]");
  must(o.max_covered >= 0 && o.max_covered <= 1, "max_covered", o.max_covered, "[0, 1]");
  must(o.push_mm > 0 && o.push_mm <= 1000, "push_mm", o.push_mm, "(0, 1000]");
  must(o.looks > 0, "looks", o.looks, "1 and more");
  must(o.most_per_part > 0, "most_per_part", o.most_per_part, "1 and more");
}

PartFacts lying(const Scene& scene, const PartHere& here) {
  PartFacts facts;
  const Part& part = *here.part->part;
  facts.columns = raster_spans(*here.part->tree, [&](const Vec3& p) {
    const Vec3 q = here.base_from_part * p;
    return Vec3(q.x() / kCell_mm, q.y() / kCell_mm, q.z());
  });
  facts.top = -1e300;
  for (std::size_t i = 0; i < facts.columns.high.size(); ++i) facts.top = std::max(facts.top, facts.columns.high[i]);
  facts.center = here.base_from_part * part.box_center();
  facts.radius_mm = 0.5 * (part.box_max - part.box_min).norm();
  const Eigen::Matrix3d place = here.covariance.topLeftCorner<3, 3>();
  const double worst = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(place).eigenvalues().maxCoeff();
  facts.sigma_mm = std::hypot(std::sqrt(std::max(worst, 0.0)), hand_eye_sigma(scene, facts.center));
  return facts;
}

/// Seen points that no found part explains and that lie within the bin's walls.
std::vector<Vec3> unexplained(const SceneFacts& facts) {
  std::vector<Vec3> out;
  for (const Vec3& p : facts.depth->points()) {
    if (facts.scene->bin) {
      const CellBin& bin = *facts.scene->bin;
      const Vec3 in_bin = bin.base_from_bin.inverse() * p;
      if (((in_bin.cwiseAbs() - 0.5 * bin.inner_size_mm).head<2>().array() > -kCell_mm).any()) continue;
    }
    const int u = static_cast<int>(std::lround(p.x() / kCell_mm)), v = static_cast<int>(std::lround(p.y() / kCell_mm));
    const bool known = std::any_of(facts.parts.begin(), facts.parts.end(), [&](const PartFacts& part) {
      if (!part.columns.covers(u, v)) return false;
      const std::size_t i = part.columns.index(u, v);
      return p.z() > part.columns.low[i] - kAbove_mm && p.z() < part.columns.high[i] + kAbove_mm;
    });
    if (!known) out.push_back(p);
  }
  return out;
}

/// The share of a part's cells that other parts, or unknown things, lie above.
double covered_share(const SceneFacts& facts, std::size_t part, const std::vector<Vec3>& unknown) {
  const SpanGrid& own = facts.parts[part].columns;
  std::vector<char> covered(own.high.size(), 0);
  int cells = 0;
  for (std::size_t j = 0; j < facts.parts.size(); ++j) {
    const SpanGrid& other = facts.parts[j].columns;
    if (j == part) continue;
    for (int v = std::max(own.v0, other.v0); v < std::min(own.v0 + own.height, other.v0 + other.height); ++v)
      for (int u = std::max(own.u0, other.u0); u < std::min(own.u0 + own.width, other.u0 + other.width); ++u)
        if (own.covers(u, v) && other.covers(u, v) &&
            other.high[other.index(u, v)] > own.high[own.index(u, v)] + kAbove_mm)
          covered[own.index(u, v)] = 1;
  }
  for (const Vec3& p : unknown) {
    const int u = static_cast<int>(std::lround(p.x() / kCell_mm)), v = static_cast<int>(std::lround(p.y() / kCell_mm));
    // At the outline depths are mixed with those behind it: that is no thing on the part.
    const bool within = own.covers(u, v) && own.covers(u - 1, v) && own.covers(u + 1, v) && own.covers(u, v - 1) &&
                        own.covers(u, v + 1);
    if (within && p.z() > own.high[own.index(u, v)] + kAbove_mm) covered[own.index(u, v)] = 1;
  }
  int count = 0;
  for (std::size_t i = 0; i < covered.size(); ++i) {
    cells += own.high[i] >= own.low[i];
    count += covered[i];
  }
  return cells > 0 ? double(count) / cells : 0;
}

/// How far a part reaches along directions all around, part frame: a hull with flat sides.
struct Hull {
  std::vector<Vec3> directions;
  std::vector<double> reach;

  bool holds(const Vec3& p, double within) const {
    for (std::size_t k = 0; k < directions.size(); ++k)
      if (directions[k].dot(p) > reach[k] - within) return false;
    return true;
  }
};

Hull hull_of(const Part& part) {
  Hull hull;
  for (const Vec3f& d : golden_spiral(32))
    for (const int side : {-1, 1}) {
      const Vec3 direction = side * d.cast<double>().normalized();
      double reach = -1e300;
      for (const Vec3f& p : part.mesh.vertices) reach = std::max(reach, direction.dot(p.cast<double>()));
      hull.directions.push_back(direction);
      hull.reach.push_back(reach);
    }
  return hull;
}

double entangled_share(const SceneFacts& facts, std::size_t part, const Hull& hull) {
  double most = 0;
  for (std::size_t j = 0; j < facts.parts.size(); ++j) {
    const PartHere& other = facts.scene->parts[j];
    const double apart = (facts.parts[j].center - facts.parts[part].center).norm();
    if (j == part || apart > facts.parts[j].radius_mm + facts.parts[part].radius_mm) continue;
    const Pose part_from_other = facts.scene->parts[part].base_from_part.inverse() * other.base_from_part;
    int within = 0;
    const std::vector<Vec3f>& points = other.part->part->sample_points;
    for (const Vec3f& p : points) within += hull.holds(part_from_other * p.cast<double>(), kWithin_mm);
    if (!points.empty()) most = std::max(most, double(within) / double(points.size()));
  }
  return most;
}

}  // namespace

double hand_eye_sigma(const Scene& scene, const Vec3& base_point) {
  const double away = (base_point - scene.base_from_camera.translation()).norm();
  return std::hypot(scene.hand_eye_sigma_mm, away * scene.hand_eye_sigma_rad);
}

double sigma_along(const Scene& scene, const PartHere& part, const Vec3& base_point, const Vec3& direction) {
  // A point moves by dt + w x arm; along d that is d . dt + (arm x d) . w.
  const Vec3 arm = base_point - part.base_from_part.translation();
  Vector6 row;
  row << direction, arm.cross(direction);
  const double pose = row.dot(Vector6(part.covariance * row));
  const Vec3 from_camera = base_point - scene.base_from_camera.translation();
  const double turn = from_camera.cross(direction).norm() * scene.hand_eye_sigma_rad;
  const double place = scene.hand_eye_sigma_mm;
  return std::sqrt(std::max(pose, 0.0) + place * place + turn * turn);
}

SceneFacts make_facts(const Scene& scene, const PlanOptions& options) {
  validate(options);
  SceneFacts facts;
  facts.scene = &scene;
  facts.options = &options;
  if (scene.bin) facts.bin = bin_bodies(*scene.bin);
  facts.parts.resize(scene.parts.size());
  const int count = static_cast<int>(scene.parts.size());
  parallel_each(count, [&](int i) { facts.parts[i] = lying(scene, scene.parts[i]); });
  std::vector<Vec3> unknown;
  if (scene.scan) {
    facts.depth.emplace(*scene.scan, scene.base_from_camera);
    unknown = unexplained(facts);
  }
  double low = 1e300, high = -1e300;
  for (const PartFacts& part : facts.parts) {
    low = std::min(low, part.top);
    high = std::max(high, part.top);
  }
  parallel_each(count, [&](int i) {
    PartFacts& part = facts.parts[i];
    part.covered = covered_share(facts, i, unknown);
    part.entangled = entangled_share(facts, i, hull_of(*scene.parts[i].part->part));
    part.height = high > low ? (part.top - low) / (high - low) : 1;
  });
  return facts;
}

}  // namespace tribin::grasp
