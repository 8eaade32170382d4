#include "surfel/cell_grid.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::surfel_detail {
namespace {

constexpr int kMaxCell = 16;

/// The median of a sparse sample of depths: the reference that keeps float sums small.
double reference_depth(const Scan& scan) {
  std::vector<float> sample;
  for (std::size_t i = 0; i < scan.z_mm.size(); i += 97)
    if (std::isfinite(scan.z_mm.data[i])) sample.push_back(scan.z_mm.data[i]);
  if (sample.empty())
    for (float z : scan.z_mm.data)
      if (std::isfinite(z)) sample.push_back(z);
  TRIBIN_ASSERT(!sample.empty());
  auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return *middle;
}

struct PlaneOfCell {
  float mean, slope_u, slope_v, residual;
};

/// A whole cell: mean and slopes are orthogonal.
PlaneOfCell fit_whole(const float* d, int n, float inverse_count, float inverse_uu) {
  const float half = 0.5f * static_cast<float>(n - 1);
  float sum = 0, sum_u = 0, sum_v = 0;
  for (int v = 0; v < n; ++v) {
    float row = 0, row_u = 0;
    for (int u = 0; u < n; ++u) {
      row += d[v * n + u];
      row_u += d[v * n + u] * (static_cast<float>(u) - half);
    }
    sum += row;
    sum_u += row_u;
    sum_v += row * (static_cast<float>(v) - half);
  }
  PlaneOfCell plane{sum * inverse_count, sum_u * inverse_uu, sum_v * inverse_uu, 0};
  float squares = 0;
  for (int v = 0; v < n; ++v) {
    const float base = plane.mean + plane.slope_v * (static_cast<float>(v) - half);
    for (int u = 0; u < n; ++u) {
      const float r = d[v * n + u] - base - plane.slope_u * (static_cast<float>(u) - half);
      squares += r * r;
    }
  }
  plane.residual = std::sqrt(squares * inverse_count);
  return plane;
}

/// A cell with holes, or on a grid that is no pinhole: general normal equations in the true pixel offsets.
bool fit_holed(const float* d, const float* x, const float* y, const bool* valid, int count, PlaneOfCell& plane) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  int points = 0;
  for (int i = 0; i < count; ++i) {
    if (!valid[i]) continue;
    const Eigen::Vector3d row(1.0, x[i], y[i]);
    a += row * row.transpose();
    b += row * static_cast<double>(d[i]);
    ++points;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(a);
  // Pixels along one line leave the slope across it free.
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() < 0.05 * points) return false;
  const Eigen::Vector3d c = solver.solve(b);
  double squares = 0;
  for (int i = 0; i < count; ++i) {
    if (!valid[i]) continue;
    const double r = d[i] - c[0] - c[1] * x[i] - c[2] * y[i];
    squares += r * r;
  }
  plane = {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
           static_cast<float>(std::sqrt(squares / points))};
  return true;
}

}  // namespace

CellGrid fit_cells(const Scan& scan, int n) {
  TRIBIN_ASSERT(n >= 2 && n <= kMaxCell);
  const Image<float>& z = scan.z_mm;
  CellGrid grid;
  grid.cell_px = n;
  grid.columns = z.width / n;
  grid.rows = z.height / n;
  grid.z_ref = reference_depth(scan);
  const std::size_t cells = static_cast<std::size_t>(grid.columns) * grid.rows;
  grid.mean.assign(cells, 0.0f);
  grid.slope_u.assign(cells, 0.0f);
  grid.slope_v.assign(cells, 0.0f);
  grid.residual.assign(cells, 0.0f);
  grid.points.assign(cells, 0);

  const int count = n * n;
  const int least = static_cast<int>(std::ceil(0.6 * count));
  const float half = 0.5f * static_cast<float>(n - 1);
  const float inverse_count = 1.0f / static_cast<float>(count);
  const float inverse_uu = 12.0f / static_cast<float>(count * (count - 1));  // sum of u^2 = n^2 (n^2 - 1) / 12
  const float z_ref = static_cast<float>(grid.z_ref);
  parallel_ranges(grid.rows, 8, [&](int begin, int end) {
    // Row of pixels -> d; (1/z - 1/z_ref) z_ref^2 written so that nothing cancels.
    std::vector<float> line(static_cast<std::size_t>(z.width) * n);
    float d[kMaxCell * kMaxCell], x[kMaxCell * kMaxCell], y[kMaxCell * kMaxCell];
    bool valid[kMaxCell * kMaxCell];
    for (int row = begin; row < end; ++row) {
      for (int v = 0; v < n; ++v) {
        const float* source = z.row(row * n + v);
        float* target = line.data() + static_cast<std::size_t>(v) * z.width;
        for (int u = 0; u < z.width; ++u) target[u] = (z_ref - source[u]) / source[u] * z_ref;
      }
      for (int column = 0; column < grid.columns; ++column) {
        const std::size_t cell = static_cast<std::size_t>(row) * grid.columns + column;
        int points = 0;
        for (int v = 0; v < n; ++v)
          for (int u = 0; u < n; ++u) {
            const float value = line[static_cast<std::size_t>(v) * z.width + column * n + u];
            const int i = v * n + u;
            valid[i] = value - value == 0.0f;  // neither NaN nor infinite
            d[i] = value;
            points += valid[i];
          }
        if (points < least) continue;
        PlaneOfCell plane;
        if (points == count && scan.rays.empty()) {
          plane = fit_whole(d, n, inverse_count, inverse_uu);
        } else {
          for (int i = 0; i < count; ++i) {
            x[i] = static_cast<float>(i % n) - half;
            y[i] = static_cast<float>(i / n) - half;
            if (scan.rays.empty()) continue;
            const Vec3f& ray = scan.rays(column * n + i % n, row * n + i / n);
            x[i] = static_cast<float>(ray.x() * scan.camera.fx + scan.camera.cx - grid.center_u(column));
            y[i] = static_cast<float>(ray.y() * scan.camera.fy + scan.camera.cy - grid.center_v(row));
          }
          if (!fit_holed(d, x, y, valid, count, plane)) continue;
        }
        grid.mean[cell] = plane.mean;
        grid.slope_u[cell] = plane.slope_u;
        grid.slope_v[cell] = plane.slope_v;
        grid.residual[cell] = plane.residual;
        grid.points[cell] = static_cast<std::uint16_t>(points);
      }
    }
  });
  return grid;
}

}  // namespace tribin::surfel_detail
