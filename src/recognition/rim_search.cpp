#include "rim_search.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

/// Directions that large planes face, apart by 3 deg, the largest first: the bin stands on one, or is one.
std::vector<Vec3> directions_up(const PrimitiveModel& observation) {
  std::vector<const Primitive*> planes;
  for (const Primitive& p : observation.primitives)
    if (p.type == PrimitiveType::plane) planes.push_back(&p);
  std::stable_sort(planes.begin(), planes.end(),
                   [](const Primitive* a, const Primitive* b) { return a->area_mm2 > b->area_mm2; });
  std::vector<Vec3> out;
  constexpr std::size_t kMost = 4;
  for (const Primitive* p : planes) {
    if (out.size() >= kMost) break;
    if (std::none_of(out.begin(), out.end(), [&](const Vec3& u) { return u.dot(p->axis) > std::cos(3 * kDegree); }))
      out.push_back(p->axis);
  }
  return out;
}

struct ThinnedPoints {
  std::vector<Vec3> points;
  double spacing = 0;  ///< at a depth of 1
};

/// The scan's points, so thinned that three lie across a wall.
ThinnedPoints thinned_points(const Surfels& surfels, double wall_mm) {
  const Scan& scan = *surfels.scan;
  std::vector<float> depths;
  for (const Vec3f& p : surfels.position) depths.push_back(p.z());
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  const double pixel = depths[depths.size() / 2] / scan.camera.fx;
  const int step = std::max(1, static_cast<int>(wall_mm / (3 * pixel)));
  ThinnedPoints out;
  out.spacing = step / scan.camera.fx;
  for (int v = step / 2; v < scan.height(); v += step)
    for (int u = step / 2; u < scan.width(); u += step)
      if (scan.z_mm(u, v) > 0) out.points.push_back(scan.point(u, v));
  return out;
}

/// Two strips at a known distance on a line: where their middle is, and how many points stand out in them.
struct StripPair {
  double middle = 0;
  double points = 0;
};

/// \param counts  points a bin, three bins a wall.
StripPair best_pair(const std::vector<int>& counts, int apart, double first, double bin) {
  const int n = static_cast<int>(counts.size());
  std::vector<int> outstanding(counts.size(), 0);  // of a strip about each bin: more than on its fuller side
  const auto sum = [&](int k) { return k < 1 || k + 1 >= n ? 0 : counts[k - 1] + counts[k] + counts[k + 1]; };
  for (int k = 0; k < n; ++k) outstanding[k] = std::max(0, sum(k) - std::max(sum(k - 4), sum(k + 4)));
  StripPair best;
  for (int k = 0; k + apart < n; ++k) {
    const double points = outstanding[k] + outstanding[k + apart];
    if (points > best.points) best = {first + bin * (k + 0.5 + 0.5 * apart), points};
  }
  return best;
}

struct Layer {
  Vec3 up, a, b;  ///< a frame with the layer's normal
  double height = 0;
  std::vector<Vec2> points;
};

/// \param every  one point in so many is counted.
RimHypothesis best_in(const Layer& layer, const BinShape& shape, double rim_points, double from, double to,
                      std::size_t every) {
  const double wall = shape.wall_mm, bin = wall / 3;
  const double length = shape.inner_size_mm.x() + wall, width = shape.inner_size_mm.y() + wall;
  // Half a step turns the longer side's end by half a wall.
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from) * std::max(length, width) / wall)));
  double reach = 0;
  for (const Vec2& p : layer.points) reach = std::max(reach, p.norm());
  const double first = -reach - 4 * wall;
  const int bins = static_cast<int>(2 * (reach + 4 * wall) / bin) + 1;
  const int apart_x = static_cast<int>(std::lround(length / bin)), apart_y = static_cast<int>(std::lround(width / bin));
  RimHypothesis best;
  std::vector<int> x, y;
  for (int step = 0; step < steps; ++step) {
    const double yaw = from + (step + 0.5) * (to - from) / steps, c = std::cos(yaw), s = std::sin(yaw);
    x.assign(bins, 0);
    y.assign(bins, 0);
    for (std::size_t i = 0; i < layer.points.size(); i += every) {
      const Vec2& p = layer.points[i];
      ++x[static_cast<std::size_t>((c * p.x() + s * p.y() - first) / bin)];
      ++y[static_cast<std::size_t>((-s * p.x() + c * p.y() - first) / bin)];
    }
    const StripPair px = best_pair(x, apart_x, first, bin), py = best_pair(y, apart_y, first, bin);
    // Both pairs are wanted; a side that is hidden leaves half of its own.
    const double score = static_cast<double>(every) * (px.points + py.points) / rim_points;
    if (score <= best.score) continue;
    best.score = score;
    const Eigen::Vector3d ex = c * layer.a + s * layer.b, ey = -s * layer.a + c * layer.b;
    best.camera_from_bin.linear().col(0) = ex;
    best.camera_from_bin.linear().col(1) = ey;
    best.camera_from_bin.linear().col(2) = layer.up;
    best.camera_from_bin.translation() =
        px.middle * ex + py.middle * ey + (layer.height - shape.inner_size_mm.z()) * layer.up;
  }
  return best;
}

}  // namespace

std::vector<RimHypothesis> seek_rim(const BinShape& shape, const Surfels& surfels, const PrimitiveModel& observation,
                                    const std::optional<Pose>& near) {
  if (surfels.size() == 0) return {};
  const auto [points, spacing] = thinned_points(surfels, shape.wall_mm);
  const double wall = shape.wall_mm, longest = std::max(shape.inner_size_mm.x(), shape.inner_size_mm.y());
  // A layer is half a wall thick, and no thinner than a tilt of 0.3 deg makes the rim.
  const double thick = std::max(0.5 * wall, 0.005 * longest);
  // Points of a rim that is wholly seen: by its area and the spacing of the points where they lie.
  const double rim_area = 2 * wall * (shape.inner_size_mm.x() + shape.inner_size_mm.y() + 2 * wall);
  std::vector<Layer> layers;
  std::vector<Vec3> ups = directions_up(observation);
  if (near) ups.assign(1, near->linear().col(2));
  for (const Vec3& up : ups) {
    Vec3 a, b;
    orthonormal_basis(up, a, b);
    if (near) a = near->linear().col(0), b = near->linear().col(1);
    double low = 1e30, high = -1e30;
    for (const Vec3& p : points) low = std::min(low, up.dot(p)), high = std::max(high, up.dot(p));
    if (near) {
      const double rim = up.dot(near->translation()) + shape.inner_size_mm.z();
      low = std::max(low, rim - 0.1 * longest), high = std::min(high, rim + 0.1 * longest);
    }
    if (!(high > low)) continue;
    // Each point is in two layers that overlap by half.
    const int count = static_cast<int>((high - low) / (0.5 * thick)) + 1;
    std::vector<Layer> own(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) own[k] = {up, a, b, low + (k + 0.5) * 0.5 * thick, {}};
    for (const Vec3& p : points) {
      const double h = up.dot(p);
      const int k = static_cast<int>(std::floor((h - low) / (0.5 * thick)));
      for (const int m : {k, k - 1})
        if (m >= 0 && m < count) own[m].points.push_back(Vec2(a.dot(p), b.dot(p)));
    }
    for (Layer& layer : own) {
      layer.height += 0.25 * thick;
      layers.push_back(std::move(layer));
    }
  }
  // One point in four: a rim has hundreds of them, and the fit has the last word.
  std::vector<RimHypothesis> found(layers.size());
  constexpr double kTurn = 15 * kDegree;  // of a bin that was put down by hand against its place
  parallel_each(static_cast<int>(layers.size()), [&](int i) {
    const Layer& layer = layers[i];
    const double z = std::abs(layer.height) / std::max(0.2, std::abs(layer.up.z()));
    const double expected = rim_area / (z * spacing * z * spacing);
    if (static_cast<double>(layer.points.size()) < 0.2 * expected) return;
    found[i] = best_in(layer, shape, expected, near ? -kTurn : 0.0, near ? kTurn : kPi, 4);
  });
  std::stable_sort(found.begin(), found.end(),
                   [](const RimHypothesis& x, const RimHypothesis& y) { return x.score > y.score; });
  std::vector<RimHypothesis> out;
  constexpr std::size_t kFew = 8;
  for (const RimHypothesis& h : found) {
    if (out.size() >= kFew || h.score < 0.1) break;  // less than a tenth of a rim is chance
    if (std::none_of(out.begin(), out.end(), [&](const RimHypothesis& o) {
          return (o.camera_from_bin.translation() - h.camera_from_bin.translation()).norm() < wall;
        }))
      out.push_back(h);
  }
  return out;
}

}  // namespace tribin
