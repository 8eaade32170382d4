#include "segmentation/boundary.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <span>

#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr int kSeam = 4;  // px: widest invalid line that is a seam and no edge
constexpr int kLeastCracks = 40;
constexpr int kAverage = 2;  // pixel edges each side that a boundary point is averaged over

/// A window of the scan with the plane's pixels; one pixel of margin all round stays empty.
struct Mask {
  int u0 = 0, v0 = 0;
  Image<std::uint8_t> in;  ///< 1 = on the plane
};

struct PixelBox {
  int low_u = 1 << 30, low_v = 1 << 30, high_u = -1, high_v = -1;
};

/// Of the first pixels of the support's cells.
PixelBox box_of(const Primitive& plane, const Surfels& s) {
  PixelBox box;
  for (std::uint32_t i : plane.surfels) {
    const int u = static_cast<int>(s.cell[i]) % s.surfel_of_cell.width * s.cell_px;
    const int v = static_cast<int>(s.cell[i]) / s.surfel_of_cell.width * s.cell_px;
    box.low_u = std::min(box.low_u, u);
    box.low_v = std::min(box.low_v, v);
    box.high_u = std::max(box.high_u, u);
    box.high_v = std::max(box.high_v, v);
  }
  return box;
}

/// Adds the pixels of one plane to a mask that has room for them.
void add_pixels(const Primitive& plane, const Surfels& s, Mask& mask);

Mask plane_pixels(std::span<const Primitive* const> planes, const Surfels& s) {
  PixelBox all;
  for (const Primitive* plane : planes) {
    const PixelBox box = box_of(*plane, s);
    all = {std::min(all.low_u, box.low_u), std::min(all.low_v, box.low_v), std::max(all.high_u, box.high_u),
           std::max(all.high_v, box.high_v)};
  }
  const int reach = 2 * s.cell_px, n = s.cell_px;
  const int u0 = std::max(0, all.low_u - reach), v0 = std::max(0, all.low_v - reach);
  const int u1 = std::min(s.scan->width(), all.high_u + n + reach),
            v1 = std::min(s.scan->height(), all.high_v + n + reach);
  Mask mask{u0 - 1, v0 - 1, Image<std::uint8_t>(u1 - u0 + 2, v1 - v0 + 2, 0)};
  for (const Primitive* plane : planes) add_pixels(*plane, s, mask);
  return mask;
}

void add_pixels(const Primitive& plane, const Surfels& s, Mask& mask) {
  const Scan& scan = *s.scan;
  const int n = s.cell_px, columns = s.surfel_of_cell.width;
  const PixelBox box = box_of(plane, s);
  int low_u = box.low_u, low_v = box.low_v, high_u = box.high_u, high_v = box.high_v;
  const int reach = 2 * n;  // an edge's cell is refused, and so may be the one beside it
  low_u = std::max(0, low_u - reach);
  low_v = std::max(0, low_v - reach);
  high_u = std::min(scan.width(), high_u + n + reach);
  high_v = std::min(scan.height(), high_v + n + reach);
  Image<std::uint8_t> near(mask.in.width, mask.in.height, 0);
  for (std::uint32_t i : plane.surfels) {
    const int u = static_cast<int>(s.cell[i]) % columns * n, v = static_cast<int>(s.cell[i]) / columns * n;
    for (int y = std::max(low_v, v - reach); y < std::min(high_v, v + n + reach); ++y)
      std::fill(near.row(y - mask.v0) + std::max(low_u, u - reach) - mask.u0,
                near.row(y - mask.v0) + std::min(high_u, u + n + reach) - mask.u0, std::uint8_t{1});
  }
  const int tile = 8 * n;
  for (int v = low_v; v < high_v; ++v)
    for (int u = low_u; u < high_u; ++u) {
      if (!near(u - mask.u0, v - mask.v0) || !std::isfinite(scan.z_mm(u, v))) continue;
      const Vec3 p = scan.point(u, v);
      const double noise = 4.0 * s.local_sigma_mm(std::min(u / tile, s.local_sigma_mm.width - 1),
                                                  std::min(v / tile, s.local_sigma_mm.height - 1));
      const double waves = 3.0 * plane.rms_mm;
      const double facing = std::max(0.2, std::abs(plane.axis.dot(p)) / p.z());
      const double distance = (plane.axis.dot(p) - plane.offset_mm) / facing;
      if (distance * distance < noise * noise + waves * waves) mask.in(u - mask.u0, v - mask.v0) = 1;
    }
}

/// Fills runs of invalid pixels, along rows and columns, that have the plane at both ends.
void bridge_seams(Mask& mask, const Scan& scan) {
  const Image<std::uint8_t> before = mask.in;
  const auto bridge = [&](int count, auto&& at) {
    int last = -1;  // place of the last pixel on the plane, if only invalid ones followed
    for (int i = 0; i < count; ++i) {
      const auto [u, v] = at(i);
      if (before(u, v)) {
        if (last >= 0 && i - last - 1 >= 1 && i - last - 1 <= kSeam)
          for (int k = last + 1; k < i; ++k) mask.in(at(k).first, at(k).second) = 1;
        last = i;
      } else if (scan.z_mm.contains(u + mask.u0, v + mask.v0) && std::isfinite(scan.z_mm(u + mask.u0, v + mask.v0))) {
        last = -1;
      }
    }
  };
  for (int v = 0; v < mask.in.height; ++v) bridge(mask.in.width, [&](int i) { return std::pair{i, v}; });
  for (int u = 0; u < mask.in.width; ++u) bridge(mask.in.height, [&](int i) { return std::pair{u, i}; });
}

/// Noise leaves single pixels in and out: each pixel takes the majority of its 3 x 3 neighbourhood.
void smooth(Mask& mask) {
  const Image<std::uint8_t> before = mask.in;
  for (int v = 1; v + 1 < before.height; ++v)
    for (int u = 1; u + 1 < before.width; ++u) {
      int sum = 0;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) sum += before(u + du, v + dv);
      mask.in(u, v) = sum >= 5;
    }
}

/// Middles of the pixel edges around one region, in order, the region on the right; sign of the area tells rim from
/// hole.
struct Trace {
  std::vector<Vec2> middles;  ///< in the mask's pixels, centres at integers
  double area = 0;            ///< > 0 around pixels, < 0 around a hole
};

Trace follow(const Image<std::uint8_t>& in, Image<std::uint8_t>& visited, int u, int v) {
  // Corner (x, y) is the upper left one of pixel (x, y). Directions E S W N; the pixels ahead on the right and the
  // left.
  constexpr int kStep[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  constexpr int kRight[4][2] = {{0, 0}, {-1, 0}, {-1, -1}, {0, -1}};
  constexpr int kLeft[4][2] = {{0, -1}, {0, 0}, {-1, 0}, {-1, -1}};
  const auto inside = [&](int x, int y) { return in.contains(x, y) && in(x, y); };
  Trace trace;
  int x = u, y = v, direction = 0;
  do {
    if (direction == 0) visited(x, y) = 1;
    const int nx = x + kStep[direction][0], ny = y + kStep[direction][1];
    trace.middles.emplace_back(0.5 * (x + nx) - 0.5, 0.5 * (y + ny) - 0.5);
    trace.area += 0.5 * (double(x) * ny - double(nx) * y);
    x = nx;
    y = ny;
    if (!inside(x + kRight[direction][0], y + kRight[direction][1]))
      direction = (direction + 1) % 4;
    else if (inside(x + kLeft[direction][0], y + kLeft[direction][1]))
      direction = (direction + 3) % 4;
  } while (x != u || y != v || direction != 0);
  return trace;
}

}  // namespace

std::optional<BoundaryCircle> fit_boundary_circle(const std::vector<Vec3f>& points, const Vec3& normal,
                                                  double pitch_mm) {
  if (points.size() < 12) return std::nullopt;
  Vec3 u, v, origin = Vec3::Zero();
  orthonormal_basis(normal, u, v);
  for (const Vec3f& p : points) origin += p.cast<double>();
  origin /= static_cast<double>(points.size());
  std::vector<Vec2> flat;
  for (const Vec3f& p : points) {
    const Vec3 q = p.cast<double>() - origin;
    flat.emplace_back(q.dot(u), q.dot(v));
  }
  // Algebraic start (x^2 + y^2 = 2 a x + 2 b y + c), then geometric steps with a Geman-McClure kernel that shrinks from
  // a fifth of the radius to the pixels.
  Vec2 c = Vec2::Zero();
  double radius = 0;
  {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const Vec2& q : flat) {
      const Eigen::Vector3d row(2 * q.x(), 2 * q.y(), 1);
      a += row * row.transpose();
      b += row * q.squaredNorm();
    }
    const Eigen::Vector3d x = a.fullPivLu().solve(b);
    c = Vec2(x[0], x[1]);
    radius = std::sqrt(std::max(0.0, x[2] + c.squaredNorm()));
  }
  if (!(radius > 2 * pitch_mm) || !std::isfinite(radius)) return std::nullopt;
  double mu = 0.2 * radius;
  for (int iteration = 0; iteration < 40; ++iteration) {
    Eigen::Matrix3d h = Eigen::Matrix3d::Identity() * 1e-12;
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const Vec2& q : flat) {
      const Vec2 d = q - c;
      const double r = std::max(d.norm(), 1e-9), e = r - radius, k = mu * mu / (mu * mu + e * e);
      const Eigen::Vector3d row(-d.x() / r, -d.y() / r, -1);
      h += k * k * row * row.transpose();
      g += k * k * e * row;
    }
    const Eigen::Vector3d x = -h.ldlt().solve(g);
    if (!x.allFinite()) return std::nullopt;
    c += Vec2(x[0], x[1]);
    radius += x[2];
    mu = std::max(2.0 * pitch_mm, 0.7 * mu);
  }
  BoundaryCircle circle;
  constexpr int kSectors = 72;  // of 5 deg
  bool sector[kSectors] = {};
  double squares = 0;
  std::size_t inliers = 0;
  for (const Vec2& q : flat) {
    const Vec2 d = q - c;
    const double e = d.norm() - radius;
    if (std::abs(e) > 4.0 * pitch_mm) continue;
    squares += e * e;
    ++inliers;
    sector[std::min(kSectors - 1, static_cast<int>((std::atan2(d.y(), d.x()) + kPi) / (2 * kPi) * kSectors))] = true;
  }
  const auto covered = std::count(sector, sector + kSectors, true);
  if (2 * inliers < flat.size() || covered * 4 < kSectors || !(radius > 2 * pitch_mm)) return std::nullopt;
  circle.center = origin + u * c.x() + v * c.y();
  circle.radius_mm = radius;
  circle.rms_mm = std::sqrt(squares / static_cast<double>(inliers));
  circle.arc = 2 * kPi * static_cast<double>(covered) / kSectors;
  return circle;
}

namespace {

/// Loops around the common pixels of some planes; the points lie on the first of them.
std::vector<BoundaryLoop> trace_loops(std::span<const Primitive* const> planes, const Surfels& surfels) {
  const Scan& scan = *surfels.scan;
  const Primitive& plane = *planes[0];
  std::vector<BoundaryLoop> loops;
  Mask mask = plane_pixels(planes, surfels);
  bridge_seams(mask, scan);
  smooth(mask);
  const double pitch = plane.axis.dot(plane.point) / plane.axis.dot(plane.point / plane.point.z()) / scan.camera.fx;
  Image<std::uint8_t> visited(mask.in.width, mask.in.height, 0);
  for (int v = 1; v < mask.in.height; ++v)
    for (int u = 0; u < mask.in.width; ++u) {
      if (!mask.in(u, v) || mask.in(u, v - 1) || visited(u, v)) continue;
      const Trace trace = follow(mask.in, visited, u, v);
      const auto count = static_cast<int>(trace.middles.size());
      if (count < kLeastCracks) continue;
      BoundaryLoop loop;
      loop.inner = trace.area < 0;
      for (int i = 0; i < count; ++i) {
        Vec2 place = Vec2::Zero();
        for (int k = -kAverage; k <= kAverage; ++k)
          place += trace.middles[static_cast<std::size_t>((i + k + count) % count)];
        place /= 2 * kAverage + 1;
        const double pu = place.x() + mask.u0, pv = place.y() + mask.v0;
        Vec3 ray = scan.camera.ray(pu, pv);
        if (!scan.rays.empty())
          ray = scan.rays(std::clamp(static_cast<int>(std::lround(pu)), 0, scan.width() - 1),
                          std::clamp(static_cast<int>(std::lround(pv)), 0, scan.height() - 1))
                    .cast<double>();
        loop.points.push_back((ray * (plane.offset_mm / plane.axis.dot(ray))).cast<float>());
      }
      loop.circle = fit_boundary_circle(loop.points, plane.axis, std::abs(pitch));
      loops.push_back(std::move(loop));
    }
  return loops;
}

}  // namespace

std::vector<BoundaryLoop> plane_boundaries(const Primitive& plane, const Surfels& surfels) {
  const Primitive* one[] = {&plane};
  return trace_loops(one, surfels);
}

void add_common_holes(std::vector<Primitive>& primitives, const Surfels& s) {
  // Nearly one plane: within 3 deg, and the other's middle within 6 sd of a pixel's depth; boxes that touch.
  constexpr double kAngle = 3.0 * kDegree;
  const int reach = 3 * s.cell_px;
  std::vector<const Primitive*> planes;
  for (const Primitive& p : primitives)
    if (p.type == PrimitiveType::plane) planes.push_back(&p);
  std::vector<PixelBox> boxes;
  for (const Primitive* p : planes) boxes.push_back(box_of(*p, s));
  std::vector<std::vector<BoundaryLoop>> common(planes.size());
  parallel_each(static_cast<int>(planes.size()), [&](int a) {
    std::vector<const Primitive*> group{planes[static_cast<std::size_t>(a)]};
    const Primitive& largest = *group[0];
    for (std::size_t b = static_cast<std::size_t>(a) + 1; b < planes.size(); ++b) {  // planes come largest first
      const PixelBox &x = boxes[static_cast<std::size_t>(a)], &y = boxes[b];
      if (x.low_u > y.high_u + reach || y.low_u > x.high_u + reach || x.low_v > y.high_v + reach ||
          y.low_v > x.high_v + reach || largest.axis.dot(planes[b]->axis) < std::cos(kAngle))
        continue;
      double sigma = 0;
      for (std::uint32_t i : planes[b]->surfels) sigma += s.sigma_mm[i] * std::sqrt(static_cast<double>(s.points[i]));
      sigma /= static_cast<double>(planes[b]->surfels.size());
      if (std::abs(largest.axis.dot(planes[b]->point) - largest.offset_mm) < 6.0 * sigma) group.push_back(planes[b]);
    }
    if (group.size() < 2) return;
    for (BoundaryLoop& loop : trace_loops(group, s)) {
      if (!loop.inner || !loop.circle) continue;
      const auto known = [&](const Primitive* p) {
        return std::any_of(p->loops.begin(), p->loops.end(), [&](const BoundaryLoop& old) {
          return old.inner && old.circle &&
                 (old.circle->center - loop.circle->center).norm() < 0.1 * loop.circle->radius_mm;
        });
      };
      if (std::none_of(group.begin(), group.end(), known))
        common[static_cast<std::size_t>(a)].push_back(std::move(loop));
    }
  });
  for (std::size_t a = 0; a < planes.size(); ++a)
    for (BoundaryLoop& loop : common[a])
      primitives[static_cast<std::size_t>(planes[a] - primitives.data())].loops.push_back(std::move(loop));
}

}  // namespace tribin::segmentation_detail
