#include "depth_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gjk.hpp"
#include "tribin/core/error.hpp"

namespace tribin::grasp {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::infinity();
// Blocks are as wide as the clearance that grippers are given.
constexpr double kBlock_mm = 2.5;
// Blocks of a finger's thickness, 15 mm: what stands beside a hole may go on for that much in it.
constexpr int kFinger = 6;
// A measurement that near to where the part should be is the part: noise and pose are some tenths, systematic errors
// of large scans a millimetre or two.
constexpr double kOwn_mm = 3;
// Columns end that far behind the surface: nothing that moves is larger.
constexpr double kColumn_mm = 3000;

int block_of(const Scan& scan) {
  std::vector<float> depths;
  for (std::size_t i = 0; i < scan.z_mm.data.size(); i += 61)
    if (std::isfinite(scan.z_mm.data[i])) depths.push_back(scan.z_mm.data[i]);
  if (depths.empty()) return 4;
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  return std::max(1, static_cast<int>(std::lround(kBlock_mm * scan.camera.fx / depths[depths.size() / 2])));
}

}  // namespace

DepthSpace::DepthSpace(const Scan& scan, const Pose& base_from_camera) {
  const int block = block_of(scan);
  camera_from_base_ = base_from_camera.inverse();
  width_ = std::max(1, (scan.width() + block - 1) / block);
  height_ = std::max(1, (scan.height() + block - 1) / block);
  // Block i holds pixels i * block .. i * block + block - 1; its middle is whole number i.
  const double middle = 0.5 * (block - 1);
  fx_ = scan.camera.fx / block;
  fy_ = scan.camera.fy / block;
  cx_ = (scan.camera.cx - middle) / block;
  cy_ = (scan.camera.cy - middle) / block;
  raw_.assign(static_cast<std::size_t>(width_) * height_, kUnknown);
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      float first = kUnknown, second = kUnknown;
      int seen = 0;
      for (int y = v * block; y < std::min((v + 1) * block, scan.height()); ++y)
        for (int x = u * block; x < std::min((u + 1) * block, scan.width()); ++x) {
          const float z = scan.z_mm(x, y);
          if (!std::isfinite(z)) continue;
          ++seen;
          if (z < first) {
            second = first;
            first = z;
          } else if (z < second) {
            second = z;
          }
        }
      raw_[static_cast<std::size_t>(v) * width_ + u] = seen > 2 ? second : first;
    }
  fill({0, 0, width_, height_});
  build();
}

void DepthSpace::build() {
  levels_.resize(1);
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse;
    coarse.width = (fine.width + 1) / 2;
    coarse.height = (fine.height + 1) / 2;
    coarse.z.assign(static_cast<std::size_t>(coarse.width) * coarse.height, kUnknown);
    for (int v = 0; v < fine.height; ++v)
      for (int u = 0; u < fine.width; ++u) {
        float& z = coarse.z[static_cast<std::size_t>(v / 2) * coarse.width + u / 2];
        z = std::min(z, fine.at(u, v));
      }
    levels_.push_back(std::move(coarse));
  }
}

void DepthSpace::fill(const Window& w) {
  levels_.assign(1, Level{width_, height_, raw_});
  build();
  // How many blocks it is to the nearest measurement, along rows, columns and diagonals: there and back again.
  const int wide = w.u1 - w.u0, high = w.v1 - w.v0;
  std::vector<int> away(static_cast<std::size_t>(wide) * high, 0);
  const auto at = [&](int u, int v) -> int& { return away[static_cast<std::size_t>(v) * wide + u]; };
  const auto nearer = [&](int u, int v, int du, int dv) {
    if (u + du >= 0 && u + du < wide && v + dv >= 0 && v + dv < high)
      at(u, v) = std::min(at(u, v), at(u + du, v + dv) + 1);
  };
  for (int v = 0; v < high; ++v)
    for (int u = 0; u < wide; ++u) {
      if (levels_[0].at(w.u0 + u, w.v0 + v) == kUnknown) at(u, v) = width_ + height_;
      for (const auto& [du, dv] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) nearer(u, v, du, dv);
    }
  for (int v = high - 1; v >= 0; --v)
    for (int u = wide - 1; u >= 0; --u)
      for (const auto& [du, dv] : {std::pair{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) nearer(u, v, du, dv);
  std::vector<float> filled = levels_[0].z;
  for (int v = 0; v < high; ++v)
    for (int u = 0; u < wide; ++u)
      if (at(u, v) > 0)
        filled[static_cast<std::size_t>(w.v0 + v) * width_ + w.u0 + u] =
            nearest_within(w.u0 + u, w.v0 + v, at(u, v) + kFinger);
  levels_[0].z = std::move(filled);
}

float DepthSpace::nearest_within(int u, int v, int radius) const {
  // Cells half as wide as the radius: they reach a little farther, and there are 25 of them at most.
  std::size_t k = 0;
  while (k + 1 < levels_.size() && (2 << k) < radius) ++k;
  const Level& level = levels_[k];
  float z = kUnknown;
  for (int y = std::max(0, v - radius) >> k; y <= std::min(level.height - 1, (v + radius) >> k); ++y)
    for (int x = std::max(0, u - radius) >> k; x <= std::min(level.width - 1, (u + radius) >> k); ++x)
      z = std::min(z, level.at(x, y));
  return z;
}

Vec3 DepthSpace::project(const Vec3& p) const {
  // What lies behind the camera is put far to its side: it covers nothing.
  const double z = std::max(p.z(), 1.0);
  return {fx_ * p.x() / z + cx_, fy_ * p.y() / z + cy_, 1 / z};
}

DepthSpace DepthSpace::without(const MeshTree& tree, const Pose& base_from_part) const {
  const Pose camera_from_part = camera_from_base_ * base_from_part;
  SpanGrid part = raster_spans(tree, [&](const Vec3& p) {
    Vec3 seen = project(camera_from_part * p);
    seen.x() = std::clamp(seen.x(), -2.0, width_ + 1.0);
    seen.y() = std::clamp(seen.y(), -2.0, height_ + 1.0);
    return seen;
  });
  DepthSpace out = *this;
  struct Own {
    std::size_t index;
    float back;
  };
  std::vector<Own> own;
  for (int v = std::max(0, part.v0 - 1); v <= std::min(height_ - 1, part.v0 + part.height); ++v)
    for (int u = std::max(0, part.u0 - 1); u <= std::min(width_ - 1, part.u0 + part.width); ++u) {
      // The border's blocks hold mixed depths of the part and of what is behind it.
      double near = 1e300, far = -1e300;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du)
          if (part.covers(u + du, v + dv)) {
            const std::size_t i = part.index(u + du, v + dv);
            near = std::min(near, 1 / part.high[i]);
            far = std::max(far, 1 / part.low[i]);
          }
      if (far < near) continue;
      const std::size_t i = static_cast<std::size_t>(v) * width_ + u;
      if (raw_[i] != kUnknown && (raw_[i] < near - kOwn_mm || raw_[i] > far + kOwn_mm)) continue;
      out.raw_[i] = kUnknown;
      own.push_back({i, part.covers(u, v) ? static_cast<float>(1 / part.low[part.index(u, v)]) : 0.f});
    }
  // Holes beside the part were as near as the part: they are filled anew as far as it may have mattered.
  const std::vector<float> before = std::move(out.levels_[0].z);
  constexpr int kBeside = 6 * kFinger;
  const Window w{std::max(0, part.u0 - kBeside), std::max(0, part.v0 - kBeside),
                 std::min(width_, part.u0 + part.width + kBeside), std::min(height_, part.v0 + part.height + kBeside)};
  if (w.u0 < w.u1 && w.v0 < w.v1)
    out.fill(w);
  else
    out.levels_[0].z = before;
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u)
      if (u < w.u0 || v < w.v0 || u >= w.u1 || v >= w.v1) {
        const std::size_t i = static_cast<std::size_t>(v) * width_ + u;
        out.levels_[0].z[i] = before[i];
      }
  for (const Own& o : own) out.levels_[0].z[o.index] = std::max(out.levels_[0].z[o.index], o.back);
  out.build();
  return out;
}

double DepthSpace::column_gap(int level, int u, int v, const Convex& body, double enough) const {
  const double z = levels_[level].at(u, v);
  if (!(z < kUnknown)) return enough;
  // The node's blocks, to their outer edges.
  const double left = (double(u << level) - 0.5 - cx_) / fx_;
  const double right = (std::min(double((u + 1) << level), double(width_)) - 0.5 - cx_) / fx_;
  const double top = (double(v << level) - 0.5 - cy_) / fy_;
  const double bottom = (std::min(double((v + 1) << level), double(height_)) - 0.5 - cy_) / fy_;
  const double end = z + kColumn_mm;
  const auto corner = [&](const Vec3& d) -> Vec3 {
    const double x = d.x() < 0 ? left : right, y = d.y() < 0 ? top : bottom;
    // Of each face the corner that lies farthest; a ray's sides may cross the axis, so both ends are compared.
    Vec3 best = Vec3::Zero();
    double most = -1e300;
    for (const double depth : {z, end}) {
      const Vec3 p(x * depth, y * depth, depth);
      if (p.dot(d) > most) most = p.dot(d), best = p;
    }
    return best;
  };
  const auto difference = [&](const gjk::V& d) -> gjk::V { return support(body, d) - corner(-d); };
  const Vec3 middle(0.5 * (left + right) * z, 0.5 * (top + bottom) * z, z);
  const gjk::V start = body.frame_from_body.translation() + 0.5 * body.sweep_mm - middle;
  return std::max(0.0, gjk::distance(difference, start, enough + body.radius_mm) - body.radius_mm);
}

double DepthSpace::gap_mm(const Convex& base_body, double enough) const {
  const Convex body = moved(camera_from_base_, base_body);
  double least = enough;
  struct Visit {
    int level, u, v;
    double gap;
  };
  std::vector<Visit> stack;
  const int top = static_cast<int>(levels_.size()) - 1;
  stack.push_back({top, 0, 0, column_gap(top, 0, 0, body, least)});
  while (!stack.empty() && least > 0) {
    const Visit visit = stack.back();
    stack.pop_back();
    if (visit.gap >= least) continue;
    if (visit.level == 0) {
      least = visit.gap;
      continue;
    }
    const Level& fine = levels_[visit.level - 1];
    Visit children[4];
    int count = 0;
    for (int k = 0; k < 4; ++k) {
      const int u = 2 * visit.u + (k & 1), v = 2 * visit.v + (k >> 1);
      if (u >= fine.width || v >= fine.height) continue;
      const Visit child{visit.level - 1, u, v, column_gap(visit.level - 1, u, v, body, least)};
      if (child.gap < least) children[count++] = child;
    }
    // The nearest is looked at first.
    std::stable_sort(children, children + count, [](const Visit& a, const Visit& b) { return a.gap > b.gap; });
    stack.insert(stack.end(), children, children + count);
  }
  return least;
}

std::vector<Vec3> DepthSpace::points() const {
  const Pose base_from_camera = camera_from_base_.inverse();
  std::vector<Vec3> out;
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const float z = raw_[static_cast<std::size_t>(v) * width_ + u];
      if (z == kUnknown) continue;
      out.push_back(base_from_camera * Vec3((u - cx_) / fx_ * z, (v - cy_) / fy_ * z, z));
    }
  return out;
}

}  // namespace tribin::grasp
