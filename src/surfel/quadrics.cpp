#include "surfel/quadrics.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/parallel.hpp"
#include "tribin/core/vector_levels.hpp"

namespace tribin::surfel_detail {
namespace {

// The fit minimises sum over cells of (mean - q)^2 + s (slope - grad q)^2, which is the least-squares fit to the pixels
// up to the curvature inside a cell. On a full symmetric window the normal equations fall apart by parity.
struct Moments {
  float m0, m2, m4, m22, s;
  Moments(int half, int cell_px) {
    double sum2 = 0, sum4 = 0;
    for (int i = -half; i <= half; ++i) {
      sum2 += i * i;
      sum4 += i * i * i * i;
    }
    const double n = 2 * half + 1;
    m0 = static_cast<float>(n * n);
    m2 = static_cast<float>(n * sum2);
    m4 = static_cast<float>(n * sum4);
    m22 = static_cast<float>(sum2 * sum2);
    s = static_cast<float>((cell_px * cell_px - 1.0) /
                           (12.0 * cell_px * cell_px));  // variance of a pixel's place in its cell
  }
};

/// Sums along one row of cells over i = -half..half, for every column.
struct RowSums {
  std::vector<float> w0, w1, w2, a0, a1, b0, b1, valid;
  explicit RowSums(std::size_t n) : w0(n), w1(n), w2(n), a0(n), a1(n), b0(n), b1(n), valid(n) {}
};

TRIBIN_VECTOR_LEVELS void sum_row(const float* w, const float* a, const float* b, const float* ok, int columns,
                                  int half, RowSums& out, std::size_t at) {
  const auto clear = [&](std::vector<float>& v) { std::fill_n(v.data() + at, columns, 0.0f); };
  for (auto* v : {&out.w0, &out.w1, &out.w2, &out.a0, &out.a1, &out.b0, &out.b1, &out.valid}) clear(*v);
  float* __restrict w0 = out.w0.data() + at;
  float* __restrict w1 = out.w1.data() + at;
  float* __restrict w2 = out.w2.data() + at;
  float* __restrict a0 = out.a0.data() + at;
  float* __restrict a1 = out.a1.data() + at;
  float* __restrict b0 = out.b0.data() + at;
  float* __restrict b1 = out.b1.data() + at;
  float* __restrict valid = out.valid.data() + at;
  for (int i = -half; i <= half; ++i) {
    const float f = static_cast<float>(i), ff = f * f;
    for (int x = half; x < columns - half; ++x) {
      w0[x] += w[x + i];
      w1[x] += f * w[x + i];
      w2[x] += ff * w[x + i];
      a0[x] += a[x + i];
      a1[x] += f * a[x + i];
      b0[x] += b[x + i];
      b1[x] += f * b[x + i];
      valid[x] += ok[x + i];
    }
  }
}

/// Buffers of one row of cells.
struct Workspace {
  std::array<std::vector<float>, 6> c;
  std::vector<float> r0, ri, rj, rii, rij, rjj, a0, ia, ja, b0, ib, jb, valid, misfit;
  explicit Workspace(std::size_t n)
      : r0(n), ri(n), rj(n), rii(n), rij(n), rjj(n), a0(n), ia(n), ja(n), b0(n), ib(n), jb(n), valid(n), misfit(n) {
    for (auto& v : c) v.resize(n);
  }
  void clear() {
    for (auto* v : {&r0, &ri, &rj, &rii, &rij, &rjj, &a0, &ia, &ja, &b0, &ib, &jb, &valid, &misfit})
      std::fill(v->begin(), v->end(), 0.0f);
  }
};

TRIBIN_VECTOR_LEVELS void add_row(const RowSums& sums, std::size_t at, int columns, float f, Workspace& k) {
  const float ff = f * f;
  const float *w0 = sums.w0.data() + at, *w1 = sums.w1.data() + at, *w2 = sums.w2.data() + at;
  const float *a0 = sums.a0.data() + at, *a1 = sums.a1.data() + at;
  const float *b0 = sums.b0.data() + at, *b1 = sums.b1.data() + at, *ok = sums.valid.data() + at;
  for (int x = 0; x < columns; ++x) {
    k.r0[x] += w0[x];
    k.ri[x] += w1[x];
    k.rj[x] += f * w0[x];
    k.rii[x] += w2[x];
    k.rij[x] += f * w1[x];
    k.rjj[x] += ff * w0[x];
  }
  for (int x = 0; x < columns; ++x) {
    k.a0[x] += a0[x];
    k.ia[x] += a1[x];
    k.ja[x] += f * a0[x];
    k.b0[x] += b0[x];
    k.ib[x] += b1[x];
    k.jb[x] += f * b0[x];
    k.valid[x] += ok[x];
  }
}

TRIBIN_VECTOR_LEVELS void solve_row(const Moments& m, int columns, Workspace& k) {
  const float s = m.s;
  const float d = m.m4 + 4 * s * m.m2;
  const float inverse_linear = 1.0f / (m.m2 + s * m.m0);
  const float inverse_mixed = 1.0f / (m.m22 + 2 * s * m.m2);
  const float inverse_difference = 1.0f / (d - m.m22);
  const float inverse_sum = 1.0f / (d + m.m22 - 2 * m.m2 * m.m2 / m.m0);
  const float ratio = m.m2 / m.m0;
  for (int x = 0; x < columns; ++x) {
    const float r3 = k.rii[x] + 2 * s * k.ia[x], r5 = k.rjj[x] + 2 * s * k.jb[x];
    const float sum = (r3 + r5 - 2 * ratio * k.r0[x]) * inverse_sum;
    const float difference = (r3 - r5) * inverse_difference;
    k.c[0][x] = k.r0[x] / m.m0 - ratio * sum;
    k.c[1][x] = (k.ri[x] + s * k.a0[x]) * inverse_linear;
    k.c[2][x] = (k.rj[x] + s * k.b0[x]) * inverse_linear;
    k.c[3][x] = 0.5f * (sum + difference);
    k.c[4][x] = (k.rij[x] + s * (k.ja[x] + k.ib[x])) * inverse_mixed;
    k.c[5][x] = 0.5f * (sum - difference);
  }
}

TRIBIN_VECTOR_LEVELS void add_misfit(const float* w, int columns, int half, float j, Workspace& k) {
  for (int i = -half; i <= half; ++i) {
    const float f = static_cast<float>(i), ff = f * f, fj = f * j, jj = j * j;
    for (int x = half; x < columns - half; ++x) {
      const float r =
          w[x + i] - (k.c[0][x] + f * k.c[1][x] + j * k.c[2][x] + ff * k.c[3][x] + fj * k.c[4][x] + jj * k.c[5][x]);
      k.misfit[x] += r * r;
    }
  }
}

/// Mean square of the means' residual, in variances of a mean, that noise alone hardly exceeds. Two allowances: 3 sd of
/// a chi2 with the window's degrees of freedom, and the local noise's own uncertainty of about 15 %.
float misfit_limit(int half) {
  const double cells = (2.0 * half + 1) * (2.0 * half + 1);
  const double dof = cells - 4.0;  // six coefficients, of which the slopes carry about two
  return static_cast<float>(1.3 * (1.0 + 3.0 * std::sqrt(2.0 / dof)));
}

}  // namespace

Quadrics fit_quadrics(const CellGrid& grid, const std::vector<float>& sigma_d, const CellNoise& noise) {
  const std::size_t cells = grid.size();
  const int columns = grid.columns, rows = grid.rows;
  const float step = static_cast<float>(grid.cell_px);
  Quadrics quadrics;
  for (auto& c : quadrics.c) c.assign(cells, 0.0f);
  quadrics.half.assign(cells, 0);

  std::vector<float> w(cells), a(cells), b(cells), ok(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    ok[i] = sigma_d[i] > 0 ? 1.0f : 0.0f;
    w[i] = ok[i] > 0 ? grid.mean[i] : 0.0f;
    a[i] = ok[i] > 0 ? grid.slope_u[i] * step : 0.0f;
    b[i] = ok[i] > 0 ? grid.slope_v[i] * step : 0.0f;
  }
  const float mean_variance = static_cast<float>(noise.mean * noise.mean);
  RowSums sums(cells);
  for (int half : kHalfWindows) {
    if (2 * half + 1 > std::min(columns, rows)) break;
    const Moments moments(half, grid.cell_px);
    const float full = moments.m0;
    const float limit = misfit_limit(half) * full * mean_variance;
    parallel_ranges(rows, 16, [&](int begin, int end) {
      for (int y = begin; y < end; ++y) {
        const std::size_t at = static_cast<std::size_t>(y) * columns;
        sum_row(w.data() + at, a.data() + at, b.data() + at, ok.data() + at, columns, half, sums, at);
      }
    });
    parallel_ranges(rows - 2 * half, 16, [&](int begin, int end) {
      Workspace k(static_cast<std::size_t>(columns));
      for (int y = begin + half; y < end + half; ++y) {
        k.clear();
        for (int j = -half; j <= half; ++j)
          add_row(sums, static_cast<std::size_t>(y + j) * columns, columns, static_cast<float>(j), k);
        solve_row(moments, columns, k);
        for (int j = -half; j <= half; ++j)
          add_misfit(w.data() + static_cast<std::size_t>(y + j) * columns, columns, half, static_cast<float>(j), k);
        const std::size_t at = static_cast<std::size_t>(y) * columns;
        for (int x = half; x < columns - half; ++x) {
          const float sigma = sigma_d[at + x];
          // A window grows only from a smaller one that passed: a step beside it ends the growth.
          if (k.valid[x] < full || quadrics.half[at + x] != half - 1 || k.misfit[x] > limit * sigma * sigma) continue;
          quadrics.half[at + x] = static_cast<std::uint8_t>(half);
          for (int c = 0; c < 6; ++c) quadrics.c[c][at + x] = k.c[c][x];
        }
      }
    });
  }
  return quadrics;
}

QuadricVariance quadric_variance(int half, int cell_px) {
  const Moments m(half, cell_px);
  const double cell = 1.0 / (cell_px * cell_px);  // variance of a cell's mean; of its slope in cells it is cell / s
  const double d = m.m4 + 4.0 * m.s * m.m2;
  const double sum = 2.0 * cell / (d + m.m22 - 2.0 * m.m2 * m.m2 / m.m0), difference = 2.0 * cell / (d - m.m22);
  return {cell / (m.m2 + m.s * m.m0), 0.25 * (sum + difference), cell / (m.m22 + 2.0 * m.s * m.m2)};
}

}  // namespace tribin::surfel_detail
