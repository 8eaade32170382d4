#include "raster.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/vector_levels.hpp"

namespace tribin::raster {
namespace {

// Without SSE 4.1 std::ceil is a call.
inline int ceil_of(float x) {
  const int i = static_cast<int>(x);
  return i + (x > static_cast<float>(i));
}
inline int floor_of(float x) {
  const int i = static_cast<int>(x);
  return i - (x < static_cast<float>(i));
}

inline float least(float a, float b, float c) {
  const float m = a < b ? a : b;
  return m < c ? m : c;
}
inline float most(float a, float b, float c) {
  const float m = a > b ? a : b;
  return m > c ? m : c;
}

/// Edge i of triangles: from which to which of their corners, and on which side of it the third lies when they turn
/// right. Always from the vertex with the lower number: both triangles beside it compute the same numbers with opposite
/// signs, so that no pixel falls between them.
TRIBIN_VECTOR_LEVELS void set_up_edge(const float* x0, const float* y0, const float* x1, const float* y1,
                                      const float* area, float side, std::size_t count, float* __restrict ex,
                                      float* __restrict ey, float* __restrict e0) {
  for (std::size_t f = 0; f < count; ++f) {
    const float sign = side * std::copysign(1.f, area[f]);
    ex[f] = (y0[f] - y1[f]) * sign;
    ey[f] = (x1[f] - x0[f]) * sign;
    e0[f] = -(ex[f] * x0[f] + ey[f] * y0[f]);
  }
}

TRIBIN_VECTOR_LEVELS void set_up_boxes(const float* c, std::size_t n, float* __restrict x0, float* __restrict x1,
                                       float* __restrict y0, float* __restrict y1, float* __restrict w_min,
                                       float* __restrict w_max, float* __restrict area) {
  const float *ax = c + kAx * n, *ay = c + kAy * n, *az = c + kAz * n, *bx = c + kBx * n, *by = c + kBy * n,
              *bz = c + kBz * n, *cx = c + kCx * n, *cy = c + kCy * n, *cz = c + kCz * n;
  for (std::size_t f = 0; f < n; ++f) {
    x0[f] = least(ax[f], bx[f], cx[f]);
    x1[f] = most(ax[f], bx[f], cx[f]);
    y0[f] = least(ay[f], by[f], cy[f]);
    y1[f] = most(ay[f], by[f], cy[f]);
  }
  for (std::size_t f = 0; f < n; ++f) area[f] = (bx[f] - ax[f]) * (cy[f] - ay[f]) - (by[f] - ay[f]) * (cx[f] - ax[f]);
  // A facet seen edge-on has rho near 0: its depth stays between those of its vertices all the same.
  for (std::size_t f = 0; f < n; ++f) w_min[f] = most(az[f], bz[f], cz[f]);
  for (std::size_t f = 0; f < n; ++f) w_max[f] = least(az[f], bz[f], cz[f]);
  for (std::size_t f = 0; f < n; ++f) w_min[f] = 1.f / w_min[f];
  for (std::size_t f = 0; f < n; ++f) w_max[f] = 1.f / w_max[f];
}

}  // namespace

TRIBIN_VECTOR_LEVELS void project_vertices(const float* p, std::size_t count, const Projection& m, float* __restrict x,
                                           float* __restrict y, float* __restrict z) {
  for (std::size_t i = 0; i < count; ++i) {
    const float a = p[3 * i], b = p[3 * i + 1], c = p[3 * i + 2];
    const float qz = m.r[6] * a + m.r[7] * b + m.r[8] * c + m.t[2];
    const float w = 1.f / qz;
    x[i] = m.fx * (m.r[0] * a + m.r[1] * b + m.r[2] * c + m.t[0]) * w + m.cx;
    y[i] = m.fy * (m.r[3] * a + m.r[4] * b + m.r[5] * c + m.t[1]) * w + m.cy;
    z[i] = qz;
  }
}

TRIBIN_VECTOR_LEVELS void sides_of_camera(const float* n, const float* offset, std::size_t count, const Vec3f& eye,
                                          float* __restrict side) {
  const float ex = eye[0], ey = eye[1], ez = eye[2];
  for (std::size_t k = 0; k < count; ++k) side[k] = n[3 * k] * ex + n[3 * k + 1] * ey + n[3 * k + 2] * ez - offset[k];
}

TRIBIN_VECTOR_LEVELS Range range_of(const float* values, std::size_t count) {
  constexpr std::size_t kLanes = 16;
  float low[kLanes], high[kLanes];
  for (std::size_t l = 0; l < kLanes; ++l) low[l] = high[l] = values[0];
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (std::size_t l = 0; l < kLanes; ++l) {
      low[l] = values[i + l] < low[l] ? values[i + l] : low[l];
      high[l] = values[i + l] > high[l] ? values[i + l] : high[l];
    }
  Range out{low[0], high[0]};
  for (std::size_t l = 1; l < kLanes; ++l) out = {std::min(out.low, low[l]), std::max(out.high, high[l])};
  for (; i < count; ++i) out = {std::min(out.low, values[i]), std::max(out.high, values[i])};
  return out;
}

TRIBIN_VECTOR_LEVELS void into_window(float* x, std::size_t count, float first, float inverse_step) {
  for (std::size_t i = 0; i < count; ++i) x[i] = (x[i] - first) * inverse_step;
}

std::size_t facing(const std::vector<float>& side, bool two_sided, std::int32_t* __restrict out) {
  std::size_t n = 0;
  for (std::size_t k = 0; k < side.size(); ++k) {
    out[n] = static_cast<std::int32_t>(k);
    n += side[k] > 0 || (two_sided && side[k] < 0);
  }
  return n;
}

void gather_corners(const RenderMesh& mesh, const std::int32_t* which, std::size_t count, const float* x,
                    const float* y, const float* z, float* __restrict out) {
  for (std::size_t f = 0; f < count; ++f) {
    const auto& t = mesh.triangles[static_cast<std::size_t>(which[f])];
    const std::uint32_t a = std::min({t[0], t[1], t[2]}), c = std::max({t[0], t[1], t[2]}),
                        b = t[0] ^ t[1] ^ t[2] ^ a ^ c;
    float* o = out + f;
    o[kAx * count] = x[a];
    o[kAy * count] = y[a];
    o[kAz * count] = z[a];
    o[kBx * count] = x[b];
    o[kBy * count] = y[b];
    o[kBz * count] = z[b];
    o[kCx * count] = x[c];
    o[kCy * count] = y[c];
    o[kCz * count] = z[c];
  }
}

TRIBIN_VECTOR_LEVELS void hold_pixels(const float* corners, std::size_t count, int width, int height,
                                      std::int32_t* __restrict hold) {
  const float *ax = corners, *ay = ax + count, *bx = ax + kBx * count, *by = bx + count, *cx = ax + kCx * count,
              *cy = cx + count;
  for (std::size_t f = 0; f < count; ++f) {
    const int i0 = ceil_of(least(ax[f], bx[f], cx[f])), i1 = floor_of(most(ax[f], bx[f], cx[f]));
    const int j0 = ceil_of(least(ay[f], by[f], cy[f])), j1 = floor_of(most(ay[f], by[f], cy[f]));
    hold[f] = (i0 <= i1) & (j0 <= j1) & (i1 >= 0) & (j1 >= 0) & (i0 < width) & (j0 < height);
  }
}

TRIBIN_VECTOR_LEVELS void facet_depths(const float* n, const float* side, std::size_t count, const Rays& rays,
                                       float* __restrict out) {
  const float ax = rays.across[0], ay = rays.across[1], az = rays.across[2];
  const float dx = rays.down[0], dy = rays.down[1], dz = rays.down[2];
  const float ox = rays.origin[0], oy = rays.origin[1], oz = rays.origin[2];
  for (std::size_t k = 0; k < count; ++k) {
    const float x = n[3 * k], y = n[3 * k + 1], z = n[3 * k + 2], inverse_rho = -1.f / side[k];
    out[3 * k] = (x * ax + y * ay + z * az) * inverse_rho;
    out[3 * k + 1] = (x * dx + y * dy + z * dz) * inverse_rho;
    out[3 * k + 2] = (x * ox + y * oy + z * oz) * inverse_rho;
  }
}

void set_up(const float* corners, std::size_t n, float* out) {
  const auto in = [&](Corner c) { return corners + static_cast<std::size_t>(c) * n; };
  const auto to = [&](Setup s) { return out + static_cast<std::size_t>(s) * n; };
  set_up_boxes(corners, n, to(kX0), to(kX1), to(kY0), to(kY1), to(kWMin), to(kWMax), to(kArea));
  const float* area = to(kArea);
  set_up_edge(in(kAx), in(kAy), in(kBx), in(kBy), area, 1, n, to(kE0x), to(kE0y), to(kE00));
  set_up_edge(in(kBx), in(kBy), in(kCx), in(kCy), area, 1, n, to(kE1x), to(kE1y), to(kE10));
  set_up_edge(in(kAx), in(kAy), in(kCx), in(kCy), area, -1, n, to(kE2x), to(kE2y), to(kE20));
}

TRIBIN_VECTOR_LEVELS void draw_triangles(Canvas& canvas, std::size_t count, int width, int height, const float* lane) {
  const float* setup = canvas.setup.data();
  const std::ptrdiff_t pitch = canvas.width;
  float* w_image = canvas.inverse_z.data()->lane;
  std::int32_t* index_image = canvas.triangle.data()->lane;
  for (std::size_t f = 0; f < count; ++f) {
    const auto of = [&](Setup s) { return setup[static_cast<std::size_t>(s) * count + f]; };
    if (of(kArea) == 0) continue;
    const std::int32_t k = canvas.front[f];
    const int j0 = std::max(0, ceil_of(of(kY0))), j1 = std::min(height - 1, floor_of(of(kY1)));
    const int i0 = std::max(0, ceil_of(of(kX0))), i1 = std::min(width - 1, floor_of(of(kX1)));
    const float e0x = of(kE0x), e1x = of(kE1x), e2x = of(kE2x), w_min = of(kWMin), w_max = of(kWMax);
    const float e0y = of(kE0y), e1y = of(kE1y), e2y = of(kE2y);
    const float e00 = of(kE00), e10 = of(kE10), e20 = of(kE20);
    const float* depth = canvas.depth.data() + 3 * static_cast<std::ptrdiff_t>(k);
    const float wx = depth[0], wy = depth[1], w0 = depth[2];
    float e0_lane[kBlock], e1_lane[kBlock], e2_lane[kBlock], w_lane[kBlock];
    for (int l = 0; l < kBlock; ++l) {
      e0_lane[l] = e0x * lane[l];
      e1_lane[l] = e1x * lane[l];
      e2_lane[l] = e2x * lane[l];
      w_lane[l] = wx * lane[l];
    }
    for (int block = i0 / kBlock * kBlock; block <= i1; block += kBlock) {
      const float x = static_cast<float>(block);
      const int from = i0 - block, to = i1 - block;
      for (int j = j0; j <= j1; ++j) {
        const float y = static_cast<float>(j);
        const float e0 = e0y * y + e00 + e0x * x, e1 = e1y * y + e10 + e1x * x, e2 = e2y * y + e20 + e2x * x;
        const float w_row = wy * y + w0 + wx * x;
        float* __restrict w_block = w_image + j * pitch + block;
        std::int32_t* __restrict index_block = index_image + j * pitch + block;
#pragma GCC ivdep
        for (int l = 0; l < kBlock; ++l) {
          float w = w_row + w_lane[l];
          w = w < w_min ? w_min : w;
          w = w > w_max ? w_max : w;
          const float before = w_block[l];
          const std::int32_t seen = index_block[l];
          const bool nearer = (w > before) & (e0 + e0_lane[l] >= 0) & (e1 + e1_lane[l] >= 0) & (e2 + e2_lane[l] >= 0) &
                              (l >= from) & (l <= to);
          w_block[l] = nearer ? w : before;
          index_block[l] = nearer ? k : seen;
        }
      }
    }
  }
}

TRIBIN_VECTOR_LEVELS void turn_normals(const float* n, const float* side, std::size_t count, const float* r,
                                       float* __restrict out) {
  for (std::size_t k = 0; k < count; ++k) {
    const float s = side[k] < 0 ? -1.f : 1.f;
    const float a = s * n[3 * k], b = s * n[3 * k + 1], c = s * n[3 * k + 2];
    out[3 * k] = r[0] * a + r[1] * b + r[2] * c;
    out[3 * k + 1] = r[3] * a + r[4] * b + r[5] * c;
    out[3 * k + 2] = r[6] * a + r[7] * b + r[8] * c;
  }
}

}  // namespace tribin::raster
