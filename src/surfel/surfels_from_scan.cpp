#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "surfel/cell_grid.hpp"
#include "surfel/cell_noise.hpp"
#include "surfel/quadrics.hpp"
#include "surfel/shape.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

using namespace surfel_detail;

constexpr int kTileCells = 8;  // the noise is taken as constant over tiles of 8 x 8 cells

/// The camera as the surfels see it: rays with z = 1 and what a pixel of slope is worth.
struct Rays {
  const Scan& scan;
  Vec3f at(double u, double v) const {
    if (scan.rays.empty()) return scan.camera.ray(u, v).cast<float>();
    const int u0 = std::clamp(static_cast<int>(u), 0, scan.width() - 2);
    const int v0 = std::clamp(static_cast<int>(v), 0, scan.height() - 2);
    const float fu = static_cast<float>(u - u0), fv = static_cast<float>(v - v0);
    return (1 - fv) * ((1 - fu) * scan.rays(u0, v0) + fu * scan.rays(u0 + 1, v0)) +
           fv * ((1 - fu) * scan.rays(u0, v0 + 1) + fu * scan.rays(u0 + 1, v0 + 1));
  }
};

/// 30 % quantile of the cells' residuals in each tile, as sd of z [mm]; empty tiles take the scan's median.
Image<float> local_noise(const CellGrid& grid, const CellNoise& noise, const Image<float>& steps) {
  const int width = (grid.columns + kTileCells - 1) / kTileCells, height = (grid.rows + kTileCells - 1) / kTileCells;
  Image<float> sigma(std::max(1, width), std::max(1, height), 0.0f);
  parallel_ranges(height, 1, [&](int begin, int end) {
    std::vector<float> residuals;
    for (int tile_row = begin; tile_row < end; ++tile_row)
      for (int tile_column = 0; tile_column < width; ++tile_column) {
        residuals.clear();
        for (int row = tile_row * kTileCells; row < std::min(grid.rows, (tile_row + 1) * kTileCells); ++row)
          for (int column = tile_column * kTileCells; column < std::min(grid.columns, (tile_column + 1) * kTileCells);
               ++column) {
            const std::size_t cell = static_cast<std::size_t>(row) * grid.columns + column;
            if (grid.points[cell] == 0) continue;
            const double z = grid.depth(grid.mean[cell]);
            residuals.push_back(static_cast<float>(grid.residual[cell] * z * z / (grid.z_ref * grid.z_ref)));
          }
        if (residuals.size() < 10) continue;  // too few for a quantile
        auto low = residuals.begin() + static_cast<std::ptrdiff_t>(3 * residuals.size() / 10);
        std::nth_element(residuals.begin(), low, residuals.end());
        const double measured = *low / noise.residual_quantile;
        const int middle = kTileCells * grid.cell_px, half = middle / 2;
        const double step = steps(std::min((tile_column * middle + half) / kQuantisationTile, steps.width - 1),
                                  std::min((tile_row * middle + half) / kQuantisationTile, steps.height - 1));
        sigma(tile_column, tile_row) = static_cast<float>(std::sqrt(measured * measured + step * step / 12.0));
      }
  });
  std::vector<float> known;
  for (float s : sigma.data)
    if (s > 0) known.push_back(s);
  float typical = 0;
  if (!known.empty()) {
    std::nth_element(known.begin(), known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2), known.end());
    typical = known[known.size() / 2];
  }
  // Median of 3 x 3 tiles, over those that know.
  Image<float> smooth(sigma.width, sigma.height, typical);
  for (int v = 0; v < sigma.height; ++v)
    for (int u = 0; u < sigma.width; ++u) {
      std::array<float, 9> near{};
      std::size_t count = 0;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du)
          if (sigma.contains(u + du, v + dv) && sigma(u + du, v + dv) > 0) near[count++] = sigma(u + du, v + dv);
      if (count == 0) continue;
      for (std::size_t i = 1; i < count; ++i)  // insertion: nine values at most
        for (std::size_t k = i; k > 0 && near[k] < near[k - 1]; --k) std::swap(near[k], near[k - 1]);
      smooth(u, v) = near[count / 2];
    }
  return smooth;
}

/// sd of d of one pixel for each cell that is one piece of smooth surface; 0 for the others: edges, mixed pixels,
/// holes.
std::vector<float> accept_cells(const CellGrid& grid, const Image<float>& sigma_mm, const CellNoise& noise,
                                double pixel_pitch) {
  std::vector<float> accepted(grid.size(), 0.0f);
  parallel_ranges(grid.rows, 16, [&](int begin, int end) {
    for (int row = begin; row < end; ++row)
      for (int column = 0; column < grid.columns; ++column) {
        const std::size_t cell = static_cast<std::size_t>(row) * grid.columns + column;
        if (grid.points[cell] == 0) continue;
        const double z = grid.depth(grid.mean[cell]);
        const double to_d = grid.z_ref * grid.z_ref / (z * z);
        const double sigma = sigma_mm(column / kTileCells, row / kTileCells) * to_d;
        // A surface of radius 1.5 cell widths, the tightest that cells can follow, bends by this rms inside a cell.
        const double width = grid.cell_px * z * pixel_pitch;
        const double bend = width / (27.0 * 1.5) * to_d;
        const double noisy = noise.residual_limit * 1.2 * sigma;  // 1.2: the local sigma's own error
        const double limit = std::sqrt(noisy * noisy + bend * bend);
        if (grid.residual[cell] <= limit) accepted[cell] = static_cast<float>(sigma);
      }
  });
  return accepted;
}

/// A quadric about one cell, and the window that it came from.
struct LocalQuadric {
  double c1 = 0, c2 = 0, c3 = 0, c4 = 0, c5 = 0;
  int half = 0;
};

/// The cell's own quadric, or that of a neighbour whose window holds this cell: cells at a rim have no window of their
/// own.
LocalQuadric quadric_at(const Quadrics& q, const CellGrid& grid, int column, int row) {
  const auto take = [&](std::size_t cell, double i, double j) {
    const double c3 = q.c[3][cell], c4 = q.c[4][cell], c5 = q.c[5][cell];
    return LocalQuadric{
        q.c[1][cell] + 2 * c3 * i + c4 * j, q.c[2][cell] + c4 * i + 2 * c5 * j, c3, c4, c5, q.half[cell]};
  };
  const std::size_t own = static_cast<std::size_t>(row) * grid.columns + column;
  LocalQuadric best;
  if (q.half[own] >= 2) return take(own, 0, 0);
  if (q.half[own] > 0) best = take(own, 0, 0);
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      if (column + i < 0 || row + j < 0 || column + i >= grid.columns || row + j >= grid.rows) continue;
      const std::size_t cell = own + static_cast<std::ptrdiff_t>(j) * grid.columns + i;
      if (q.half[cell] > best.half) best = take(cell, -i, -j);
    }
  return best;
}

struct Curvature {
  double k1 = 0, k2 = 0, sigma = 0;
  Vec3 direction2 = Vec3::Zero();
};

/// Principal curvatures of the surface 1/z = w(x, y) in ray coordinates. With m = (w_x, w_y, w - x w_x - y w_y), the
/// normal is -m / |m| and the second fundamental form is exactly w_ij / (w |m|).
Curvature curvature_of(const Vec3& ray, double w, double wx, double wy, const double second[3],
                       const double variance[2]) {
  const Vec3 m(wx, wy, w - ray.x() * wx - ray.y() * wy);
  const double scale = 1.0 / (w * m.norm());
  const Vec3 tx = Vec3::UnitX() / w - ray * (wx / (w * w)), ty = Vec3::UnitY() / w - ray * (wy / (w * w));
  // Shape operator in an orthonormal tangent frame: (tx, ty) = L^-T frame by Cholesky of the first form.
  const double e = tx.dot(tx), f = tx.dot(ty), g = ty.dot(ty);
  const double l11 = std::sqrt(e), l21 = f / l11, l22 = std::sqrt(std::max(g - l21 * l21, 1e-300));
  // Parameter steps of the two orthonormal directions: t1 = tx / l11, t2 = (ty - (l21 / l11) tx) / l22.
  const double p1 = 1.0 / l11, q1 = -l21 / (l11 * l22), q2 = 1.0 / l22;
  const double s11 = -scale * second[0] * p1 * p1;
  const double s12 = -scale * p1 * (second[0] * q1 + second[1] * q2);
  const double s22 = -scale * (second[0] * q1 * q1 + 2 * second[1] * q1 * q2 + second[2] * q2 * q2);
  const double middle = 0.5 * (s11 + s22), skew = 0.5 * (s11 - s22), half = std::sqrt(skew * skew + s12 * s12);
  // Direction of the algebraically larger one: half the angle of (skew, s12), by the half-angle formulas.
  double c = 1, sn = 0;
  if (half > 0) {
    c = std::sqrt(std::max(0.0, 0.5 * (1 + std::abs(skew) / half)));
    sn = 0.5 * s12 / (half * c);
    if (skew < 0) {
      std::swap(c, sn);
      if (c < 0) c = -c, sn = -sn;
    }
  }
  Curvature k;
  k.k1 = middle + half;
  k.k2 = middle - half;
  if (std::abs(k.k2) > std::abs(k.k1)) {
    std::swap(k.k1, k.k2);
    std::swap(c, sn);
    c = -c;
  }
  const Vec3 t1 = tx * p1, t2 = tx * q1 + ty * q2;
  k.direction2 = (-sn * t1 + c * t2).normalized();
  const double a = c * p1 + sn * q1, b = sn * q2;  // direction 1 in parameters
  k.sigma = scale * std::sqrt((a * a * a * a + b * b * b * b) * variance[0] + 4 * a * a * b * b * variance[1]);
  return k;
}

void fill_surfel(Surfels& s, std::size_t index, const Scan& scan, const CellGrid& grid, const Quadrics& quadrics,
                 float sigma_d, const CellNoise& noise, double noise_inflation, float max_radius_mm) {
  const std::size_t cell = s.cell[index];
  const int column = static_cast<int>(cell % grid.columns), row = static_cast<int>(cell / grid.columns);
  const LocalQuadric q = quadric_at(quadrics, grid, column, row);
  const double n = grid.cell_px, z2 = grid.z_ref * grid.z_ref;
  const double slope_u = q.half > 0 ? q.c1 / n : grid.slope_u[cell],
               slope_v = q.half > 0 ? q.c2 / n : grid.slope_v[cell];
  // The mean of a curved cell lies off its centre by the sagitta.
  const double sag = (n * n - 1) / (12.0 * n * n) * (q.c3 + q.c5);
  const double d = grid.mean[cell] - (q.half > 0 ? sag : 0.0);
  const double z = grid.depth(d), w = 1.0 / z;
  const Vec3 ray = Rays{scan}.at(grid.center_u(column), grid.center_v(row)).cast<double>();
  const double fx = scan.camera.fx, fy = scan.camera.fy;
  const double wx = slope_u * fx / z2, wy = slope_v * fy / z2;
  const Vec3 m(wx, wy, w - ray.x() * wx - ray.y() * wy);
  const Vec3 normal = -m.normalized();
  const double facing = -normal.dot(ray);  // distance off the surface per mm of z
  const double sigma_z = sigma_d * z * z / z2;

  s.position[index] = (ray * z).cast<float>();
  s.normal[index] = normal.cast<float>();
  s.sigma_mm[index] = static_cast<float>(sigma_z * noise.mean * std::sqrt(n * n / grid.points[cell]) * facing);
  s.area_mm2[index] = static_cast<float>(grid.points[cell] * z * z / (fx * fy * std::max(facing, 0.05)));
  s.points[index] = grid.points[cell];

  const auto slope_to_angle = [&](double slope_variance) {  // per pixel of d -> tilt of the normal, in the steeper axis
    return std::sqrt(slope_variance) * sigma_d * std::max(fx, fy) / z2 / m.norm();
  };
  if (q.half == 0) {
    s.sigma_normal[index] = static_cast<float>(slope_to_angle(noise.slope * noise.slope));
    s.sigma_curvature[index] = 1.0f;  // 1/mm: nothing is known
    Vec3 u, v;
    orthonormal_basis(normal, u, v);
    s.direction2[index] = u.cast<float>();
    return;
  }
  const QuadricVariance unit = quadric_variance(q.half, grid.cell_px);
  const double variance = noise_inflation * sigma_d * sigma_d;
  s.sigma_normal[index] = static_cast<float>(slope_to_angle(unit.gradient * noise_inflation / (n * n)));
  const double per_cell = 1.0 / (n * n * z2);
  const double second[3] = {2 * q.c3 * per_cell * fx * fx, q.c4 * per_cell * fx * fy, 2 * q.c5 * per_cell * fy * fy};
  const double scale2 = std::pow(per_cell * fx * fy, 2) * variance;
  const double variances[2] = {4 * unit.square * scale2, unit.mixed * scale2};
  const Curvature k = curvature_of(ray, w, wx, wy, second, variances);
  s.curvature1[index] = static_cast<float>(k.k1);
  s.curvature2[index] = static_cast<float>(k.k2);
  s.sigma_curvature[index] = static_cast<float>(k.sigma);
  s.direction2[index] = k.direction2.cast<float>();
  s.shape[index] = shape_of(k.k1, k.k2, k.sigma, max_radius_mm);
}

/// 8-neighbours whose planes meet half way. Tangent planes of one smooth surface agree there whatever its curvature, so
/// the test is of noise alone; a crease passes, a step does not.
void connect(Surfels& s, const CellGrid& grid, const std::vector<float>& sigma_d, const CellNoise& noise) {
  const double at_middle = std::sqrt(2.0 * (noise.mean * noise.mean + std::pow(noise.slope * 0.5 * grid.cell_px, 2)));
  constexpr int kAround[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}};
  const std::size_t count = s.size();
  const auto touching = [&](std::size_t i, int k) -> std::int64_t {
    const int column = static_cast<int>(s.cell[i] % grid.columns) + kAround[k][0];
    const int row = static_cast<int>(s.cell[i] / grid.columns) + kAround[k][1];
    if (!s.surfel_of_cell.contains(column, row)) return -1;
    const std::int32_t j = s.surfel_of_cell(column, row);
    if (j < 0) return -1;
    const std::size_t a = s.cell[i], b = s.cell[static_cast<std::size_t>(j)];
    const double du = 0.5 * grid.cell_px * kAround[k][0], dv = 0.5 * grid.cell_px * kAround[k][1];
    const double from_a = grid.mean[a] + grid.slope_u[a] * du + grid.slope_v[a] * dv;
    const double from_b = grid.mean[b] - grid.slope_u[b] * du - grid.slope_v[b] * dv;
    return std::abs(from_a - from_b) < 4.0 * at_middle * std::max(sigma_d[a], sigma_d[b]) ? j : -1;
  };
  std::vector<std::uint8_t> mask(count, 0);
  parallel_ranges(static_cast<int>(count), 4096, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      for (int k = 0; k < 8; ++k)
        if (touching(static_cast<std::size_t>(i), k) >= 0) mask[i] |= static_cast<std::uint8_t>(1u << k);
  });
  s.neighbour_begin.resize(count + 1);
  s.neighbour_begin[0] = 0;
  for (std::size_t i = 0; i < count; ++i)
    s.neighbour_begin[i + 1] = s.neighbour_begin[i] + static_cast<std::uint32_t>(__builtin_popcount(mask[i]));
  s.neighbours.resize(s.neighbour_begin[count]);
  parallel_ranges(static_cast<int>(count), 4096, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      std::uint32_t at = s.neighbour_begin[i];
      const std::int64_t cell = s.cell[i];
      for (int k = 0; k < 8; ++k)
        if (mask[i] & (1u << k))
          s.neighbours[at++] = static_cast<std::uint32_t>(
              s.surfel_of_cell
                  .data[static_cast<std::size_t>(cell + std::int64_t{kAround[k][1]} * grid.columns + kAround[k][0])]);
    }
  });
}

void resize(Surfels& s, std::size_t count) {
  s.position.resize(count);
  s.normal.resize(count);
  s.curvature1.assign(count, 0.0f);
  s.curvature2.assign(count, 0.0f);
  s.direction2.resize(count);
  s.sigma_curvature.resize(count);
  s.sigma_normal.resize(count);
  s.sigma_mm.resize(count);
  s.area_mm2.resize(count);
  s.shape.assign(count, SurfelShape::unknown);
  s.points.resize(count);
}

/// The cell whose largest window proves "flat" against the largest radius: sd(kappa) = 26.8 sigma_eff / (p^2 W^3).
int choose_cell(const ThirdDifferences& noise, double pitch_mm, float max_radius_mm) {
  const double sigma_eff = noise.sigma_mm * std::max(1.0, 3.54 * noise.correlation_px);
  const double window = std::cbrt(26.8 * 3.2 / 0.7 * sigma_eff * max_radius_mm / (pitch_mm * pitch_mm));
  return std::clamp(static_cast<int>(std::ceil(window / 9.0)), 4, 8);
}

double median_depth(const Scan& scan) {
  std::vector<float> sample;
  for (std::size_t i = 0; i < scan.z_mm.size(); i += 61)
    if (std::isfinite(scan.z_mm.data[i])) sample.push_back(scan.z_mm.data[i]);
  if (sample.empty()) return 0;
  std::nth_element(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2), sample.end());
  return sample[sample.size() / 2];
}

}  // namespace

NoiseProfile estimate_noise(const Scan& scan) {
  NoiseProfile profile = scan.noise;
  const ThirdDifferences measured = noise_from_third_differences(scan, quantisation_steps(scan));
  profile.sigma_mm = measured.sigma_mm;
  profile.correlation_px = measured.correlation_px;
  return profile;
}

Surfels surfels_from_scan(const Scan& scan, const SurfelOptions& options) {
  const std::size_t valid = valid_count(scan);
  if (valid < 100)
    throw Error(ErrorCode::too_little_data, scan.source + ": " + std::to_string(valid) + " of " +
                                                std::to_string(scan.z_mm.size()) +
                                                " pixels hold a depth, at least 100 are needed");
  if (options.cell_px != 0 && (options.cell_px < 2 || options.cell_px > 16))
    throw Error(ErrorCode::bad_option,
                "cell_px is " + std::to_string(options.cell_px) + ", wanted 2 to 16, or 0 for automatic");

  const Image<float> steps = quantisation_steps(scan);
  ThirdDifferences typical = noise_from_third_differences(scan, steps);
  if (scan.noise.correlation_px >= 0) typical.correlation_px = scan.noise.correlation_px;
  if (scan.noise.sigma_mm > 0) typical.sigma_mm = scan.noise.sigma_mm;
  const double pitch = median_depth(scan) / std::max(scan.camera.fx, scan.camera.fy);
  const int n = options.cell_px != 0 ? options.cell_px : choose_cell(typical, pitch, options.max_radius_mm);
  const CellNoise noise = cell_noise(n, typical.correlation_px);
  const CellGrid grid = fit_cells(scan, n);

  Surfels s;
  s.scan = &scan;
  s.cell_px = n;
  s.correlation_px = typical.correlation_px;
  s.max_radius_mm = options.max_radius_mm;
  s.local_sigma_mm = local_noise(grid, noise, steps);
  const std::vector<float> sigma_d =
      accept_cells(grid, s.local_sigma_mm, noise, 1.0 / std::min(scan.camera.fx, scan.camera.fy));
  const Quadrics quadrics = fit_quadrics(grid, sigma_d, noise);

  s.surfel_of_cell = Image<std::int32_t>(grid.columns, grid.rows, -1);
  for (std::size_t cell = 0; cell < grid.size(); ++cell) {
    if (sigma_d[cell] <= 0) continue;
    s.surfel_of_cell.data[cell] = static_cast<std::int32_t>(s.cell.size());
    s.cell.push_back(static_cast<std::uint32_t>(cell));
  }
  resize(s, s.cell.size());
  // Over windows wider than the correlation, noise counts as white noise of sd sigma sqrt(4 pi) c.
  const double inflation = std::max(1.0, 4.0 * kPi * typical.correlation_px * typical.correlation_px);
  parallel_ranges(static_cast<int>(s.size()), 2048, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      fill_surfel(s, static_cast<std::size_t>(i), scan, grid, quadrics, sigma_d[s.cell[i]], noise, inflation,
                  options.max_radius_mm);
  });
  connect(s, grid, sigma_d, noise);
  return s;
}

}  // namespace tribin
