#include "sim/distance_field.hpp"

#include <algorithm>
#include <cmath>

#include "sim/mesh_distance.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::sim {
namespace {

// Fine cells: the field is off by half a cell at worst, at sharp edges, so that 1 mm keeps within the 0.5 mm that parts
// may overlap; small parts get 1/160 of their diameter, some thousand blocks for any shape.
constexpr double kLargestCell = 1;
constexpr double kCellsPerDiameter = 160;
// Fine nodes reach this far from the surface, so that contacts, which begin within 1 mm, are looked up in them.
constexpr double kFineReach = 1.5;

/// Value and gradient of the trilinear interpolation in a cell with corner values c[x + 2 y + 4 z].
float trilinear(const std::array<float, 8>& c, const Vec3f& f, Vec3f* gradient) {
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float x00 = mix(c[0], c[1], f.x()), x10 = mix(c[2], c[3], f.x()), x01 = mix(c[4], c[5], f.x()),
              x11 = mix(c[6], c[7], f.x());
  const float y0 = mix(x00, x10, f.y()), y1 = mix(x01, x11, f.y());
  if (gradient) {
    const float dx0 = mix(c[1] - c[0], c[3] - c[2], f.y()), dx1 = mix(c[5] - c[4], c[7] - c[6], f.y());
    *gradient = Vec3f(mix(dx0, dx1, f.z()), mix(x10 - x00, x11 - x01, f.z()), y1 - y0);
  }
  return mix(y0, y1, f.z());
}

}  // namespace

DistanceField::DistanceField(const Mesh& mesh) {
  const MeshDistance exact(mesh);
  const double diagonal = diameter(mesh.vertices);
  cell_ = static_cast<float>(std::min(kLargestCell, diagonal / kCellsPerDiameter));
  coarse_ = kBlock * cell_;
  const Box box = bounding_box(mesh.vertices);
  for (int k = 0; k < 3; ++k) {
    cells_[k] = static_cast<int>(std::ceil(box.size()[k] / coarse_)) + 2;  // a coarse cell of air all round
    origin_[k] = static_cast<float>(box.center()[k]) - 0.5f * static_cast<float>(cells_[k]) * coarse_;
  }
  const int nx = cells_[0] + 1, ny = cells_[1] + 1, nz = cells_[2] + 1;
  nodes_.resize(static_cast<std::size_t>(nx) * ny * nz);
  parallel_ranges(nz, 1, [&](int begin, int) {
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const Vec3 p = (origin_ + coarse_ * Vec3f(x, y, begin)).cast<double>();
        nodes_[(static_cast<std::size_t>(begin) * ny + y) * nx + x] = static_cast<float>(exact.signed_distance(p));
      }
  });

  const double reach = std::sqrt(3.0) / 2 * coarse_ + std::max<double>(kFineReach, 2 * cell_);
  block_.assign(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2], -1);
  std::vector<std::array<int, 3>> blocks;
  for (int z = 0; z < cells_[2]; ++z)
    for (int y = 0; y < cells_[1]; ++y)
      for (int x = 0; x < cells_[0]; ++x) {
        const Vec3 p = (origin_ + coarse_ * Vec3f(x + 0.5f, y + 0.5f, z + 0.5f)).cast<double>();
        if (std::abs(exact.signed_distance(p)) > reach) continue;
        block_[(static_cast<std::size_t>(z) * cells_[1] + y) * cells_[0] + x] =
            static_cast<std::int32_t>(blocks.size());
        blocks.push_back({x, y, z});
      }
  constexpr int kNodes = kBlock + 1;
  fine_.resize(blocks.size() * kNodes * kNodes * kNodes);
  parallel_ranges(static_cast<int>(blocks.size()), 16, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      float* out = fine_.data() + static_cast<std::size_t>(b) * kNodes * kNodes * kNodes;
      const Vec3f corner = origin_ + coarse_ * Vec3f(blocks[b][0], blocks[b][1], blocks[b][2]);
      double before = 1e30;  // the next node is at most a cell further off: a small ball to search
      for (int z = 0; z < kNodes; ++z)
        for (int y = 0; y < kNodes; ++y)
          for (int x = 0; x < kNodes; ++x) {
            const double limit = x > 0 ? 1.001 * (std::abs(before) + cell_) + 1e-3 : 1e30;
            before = exact.signed_distance((corner + cell_ * Vec3f(x, y, z)).cast<double>(), limit);
            *out++ = static_cast<float>(before);
          }
    }
  });
}

float DistanceField::interpolated(const Vec3f& point, Vec3f* gradient) const {
  const Vec3f g = (point - origin_) / coarse_;
  std::array<int, 3> cell{};
  Vec3f f;
  for (int k = 0; k < 3; ++k) {
    cell[k] = std::clamp(static_cast<int>(std::floor(g[k])), 0, cells_[k] - 1);
    f[k] = std::clamp(g[k] - static_cast<float>(cell[k]), 0.0f, 1.0f);
  }
  std::array<float, 8> c{};
  const std::int32_t b = block_[(static_cast<std::size_t>(cell[2]) * cells_[1] + cell[1]) * cells_[0] + cell[0]];
  float side = coarse_;
  if (b < 0) {
    const int nx = cells_[0] + 1, ny = cells_[1] + 1;
    for (int i = 0; i < 8; ++i)
      c[i] =
          nodes_[(static_cast<std::size_t>(cell[2] + (i >> 2)) * ny + cell[1] + (i >> 1 & 1)) * nx + cell[0] + (i & 1)];
  } else {
    constexpr int kNodes = kBlock + 1;
    const float* fine = fine_.data() + static_cast<std::size_t>(b) * kNodes * kNodes * kNodes;
    std::array<int, 3> at{};
    for (int k = 0; k < 3; ++k) {
      const float t = f[k] * kBlock;
      at[k] = std::min(static_cast<int>(t), kBlock - 1);
      f[k] = t - static_cast<float>(at[k]);
    }
    for (int i = 0; i < 8; ++i)
      c[i] = fine[((at[2] + (i >> 2)) * kNodes + at[1] + (i >> 1 & 1)) * kNodes + at[0] + (i & 1)];
    side = cell_;
  }
  const float d = trilinear(c, f, gradient);
  if (gradient) *gradient /= side;
  return d;
}

float DistanceField::at(const Vec3f& point) const {
  Vec3f inside = point;
  for (int k = 0; k < 3; ++k)
    inside[k] = std::clamp(point[k], origin_[k], origin_[k] + static_cast<float>(cells_[k]) * coarse_);
  return interpolated(inside, nullptr) + (point - inside).norm();
}

float DistanceField::at(const Vec3f& point, Vec3f& gradient) const {
  const float d = interpolated(point, &gradient);
  const float length = gradient.norm();
  gradient = length > 1e-6f ? Vec3f(gradient / length) : Vec3f(0, 0, 1);
  return d;
}

float DistanceField::lower_bound(const Vec3f& point) const {
  const Vec3f g = (point - origin_) / coarse_;
  std::array<int, 3> node{}, cell{};
  Vec3f outside = Vec3f::Zero();
  for (int k = 0; k < 3; ++k) {
    node[k] = std::clamp(static_cast<int>(std::lround(g[k])), 0, cells_[k]);
    cell[k] = std::clamp(static_cast<int>(std::floor(g[k])), 0, cells_[k] - 1);
    outside[k] = std::max({-g[k], g[k] - static_cast<float>(cells_[k]), 0.0f});
  }
  // The part lies half a coarse cell or more within the grid.
  const float to_grid = coarse_ * outside.norm();
  if (to_grid > 0) return to_grid + 0.5f * coarse_;
  // The distance changes by at most its way: from the nearest node, or within a fine cell by its half diagonal.
  if (block_[(static_cast<std::size_t>(cell[2]) * cells_[1] + cell[1]) * cells_[0] + cell[0]] >= 0)
    return interpolated(point, nullptr) - 0.87f * cell_;
  const Vec3f at = origin_ + coarse_ * Vec3f(node[0], node[1], node[2]);
  return nodes_[(static_cast<std::size_t>(node[2]) * (cells_[1] + 1) + node[1]) * (cells_[0] + 1) + node[0]] -
         (point - at).norm();
}

}  // namespace tribin::sim
