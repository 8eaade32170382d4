#include "surface_sums.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "inside_silhouette.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/core/vector_levels.hpp"

namespace tribin {
namespace {

constexpr int kBandRows = 16;

constexpr std::size_t kLanes = 16;
constexpr float kFarOff = 1e15f;  // a residual that weighs nothing

/// What `accumulate` reads of the pixels of a band: numbers of a point, one array each.
struct Points {
  enum Field { kResidual, kVariance, kJacobian, kE2 = kJacobian + 6, kFields };

  /// Room for so many, and for lanes that are not filled.
  void clear(std::size_t most) {
    stride = (most + 2 * kLanes - 1) / kLanes * kLanes;
    data.resize(kFields * stride);
    count = 0;
  }
  float* field(int f) { return data.data() + static_cast<std::size_t>(f) * stride; }
  void add(float residual_mm, float variance, const std::array<float, 6>& row) {
    float* at = data.data() + count++;
    at[kResidual * stride] = residual_mm;
    at[kVariance * stride] = variance;
    for (std::size_t a = 0; a < 6; ++a) at[(kJacobian + a) * stride] = row[a];
  }

  std::vector<float> data;
  std::size_t stride = 0, count = 0;
};

constexpr std::size_t kSums = 21 + 6 + 4;  // h, b, squares, squares_sigma, weight, pixels

/// Weighted sums over points, each lane by itself. \param sums  kSums arrays of kLanes
TRIBIN_VECTOR_LEVELS void weigh_points(const float* r, const float* variance, const float* jacobian, std::size_t stride,
                                       std::size_t count, float scale2_mm, float kernel2, bool final_pass, float* e2,
                                       float* __restrict sums) {
  for (std::size_t k = 0; k < count; k += kLanes) {
    float w[kLanes], robust[kLanes], in[kLanes];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float x = r[k + l], v = variance[k + l], x2 = x * x;
      e2[k + l] = x2 / v;
      const float least = kernel2 * v;
      const float scale2 = scale2_mm > least ? scale2_mm : least;
      const float g = scale2 / (scale2 + x2);
      const float weight = g * g;
      const float kept = weight < 0.25f ? 0.f : 1.f;
      in[l] = weight > 0.25f ? 1.f : 0.f;
      robust[l] = final_pass ? weight * kept : weight;
      w[l] = (final_pass ? kept : weight) / v;
    }
    float* out = sums;
    for (std::size_t a = 0; a < 6; ++a) {
      float wa[kLanes];
      for (std::size_t l = 0; l < kLanes; ++l) wa[l] = w[l] * jacobian[a * stride + k + l];
      for (std::size_t c = a; c < 6; ++c, out += kLanes)
        for (std::size_t l = 0; l < kLanes; ++l) out[l] += wa[l] * jacobian[c * stride + k + l];
    }
    for (std::size_t a = 0; a < 6; ++a, out += kLanes)
      for (std::size_t l = 0; l < kLanes; ++l) out[l] += w[l] * jacobian[a * stride + k + l] * r[k + l];
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += robust[l] > 0 ? robust[l] * r[k + l] * r[k + l] : 0;
    out += kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += robust[l] > 0 ? robust[l] * e2[k + l] : 0;
    out += kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += robust[l];
    out += kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += in[l];
  }
}

/// Patches of a band: squares of the render and directions of the normal. Where most of a patch misfits, the few points
/// that fit do so by chance: where the surface crosses the scan, and where edges mix.
class Patches {
 public:
  void clear(int width) { counts_.assign(static_cast<std::size_t>((width + kSide - 1) / kSide) * kDirections, {}); }
  /// \return the patch of a point in column i
  std::uint32_t count(int i, const Vec3f& normal, bool fits) {
    const auto level = [](float x) { return static_cast<int>(2 * x + 2.5f); };  // 0 to 4
    const int direction = (level(normal[0]) * 5 + level(normal[1])) * 5 + level(normal[2]);
    const auto patch = static_cast<std::uint32_t>((i / kSide) * kDirections + direction);
    ++counts_[patch].all;
    counts_[patch].fit += fits;
    return patch;
  }
  bool fits(std::uint32_t patch) const {
    constexpr int kLeast = 12;  // three points by four: fewer are an edge of a surface, and what is mixed there
    return counts_[patch].fit >= kLeast && 2 * counts_[patch].fit >= counts_[patch].all;
  }

 private:
  static constexpr int kSide = kBandRows, kDirections = 125;
  struct Count {
    int all = 0, fit = 0;
  };
  std::vector<Count> counts_;
};

/// The points of some rows of a render.
/// \param patches  if given, points of those that mostly misfit are left out.
/// \param scale2_mm, kernel2  what fits, as in weigh_points.
void gather_points(const SceneDepth& scene, const IndexRender& render, const Eigen::Vector3d& center,
                   double cad_sigma_mm, int begin, int end, Patches* patches, float scale2_mm, float kernel2,
                   Points& out) {
  thread_local std::vector<std::uint32_t> patch_of;
  patch_of.clear();
  if (patches != nullptr) patches->clear(render.width);
  const PinholeCamera& camera = scene.camera;
  const auto cx = static_cast<float>(center.x()), cy = static_cast<float>(center.y()),
             cz = static_cast<float>(center.z());
  const auto cad_variance = static_cast<float>(cad_sigma_mm * cad_sigma_mm);
  const int rim = scene.rim(render.step);
  for (int j = begin; j < end; ++j) {
    const int v = render.v0 + j * render.step;
    const auto ry = static_cast<float>((v - camera.cy) / camera.fy);
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t k = render.triangle[render.index(i, j)];
      if (k < 0) continue;
      const int u = render.u0 + i * render.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j, rim)) continue;
      const auto rx = static_cast<float>((u - camera.cx) / camera.fx);
      const Vec3f& n = render.normal[static_cast<std::size_t>(k)];
      const float along = n[0] * rx + n[1] * ry + n[2];  // n . ray, negative
      const float sigma = scene.sigma_mm(u, v) * along;
      const float px = rx * z - cx, py = ry * z - cy, pz = z - cz;
      const float r = (z - 1 / render.inverse_z[render.index(i, j)]) * along, variance = sigma * sigma + cad_variance;
      out.add(r, variance, {n[0], n[1], n[2], py * n[2] - pz * n[1], pz * n[0] - px * n[2], px * n[1] - py * n[0]});
      if (patches != nullptr) patch_of.push_back(patches->count(i, n, r * r < std::max(scale2_mm, kernel2 * variance)));
    }
  }
  if (patches == nullptr) return;
  float* residual = out.field(Points::kResidual);
  for (std::size_t k = 0; k < patch_of.size(); ++k)
    if (!patches->fits(patch_of[k])) residual[k] = kFarOff;
}

}  // namespace

SurfaceSums surface_sums(const SceneDepth& scene, const IndexRender& render, const Eigen::Vector3d& center,
                         double scale_mm, double cad_sigma_mm, double kernel_sigmas, bool by_patches, bool final_pass) {
  std::vector<SurfaceSums> bands(static_cast<std::size_t>((render.height + kBandRows - 1) / kBandRows));
  const auto band = [&](int begin, int end) {
    thread_local Points points;
    points.clear(static_cast<std::size_t>(render.width) * static_cast<std::size_t>(end - begin));
    thread_local Patches patches;
    const auto scale2_mm = static_cast<float>(scale_mm * scale_mm),
               kernel2 = static_cast<float>(kernel_sigmas * kernel_sigmas);
    gather_points(scene, render, center, cad_sigma_mm, begin, end, by_patches ? &patches : nullptr, scale2_mm, kernel2,
                  points);
    const std::size_t count = points.count;
    while (points.count % kLanes) points.add(kFarOff, 1, {});
    std::array<float, kSums * kLanes> lanes{};
    float* e2 = points.field(Points::kE2);
    weigh_points(points.field(Points::kResidual), points.field(Points::kVariance), points.field(Points::kJacobian),
                 points.stride, points.count, scale2_mm, kernel2, final_pass, e2, lanes.data());
    const auto sum_of = [&](std::size_t s) {
      double sum = 0;
      for (std::size_t l = 0; l < kLanes; ++l) sum += static_cast<double>(lanes[s * kLanes + l]);
      return sum;
    };
    SurfaceSums& s = bands[static_cast<std::size_t>(begin / kBandRows)];
    for (std::size_t i = 0; i < 21; ++i) s.h[i] = sum_of(i);
    for (std::size_t i = 0; i < 6; ++i) s.b[i] = sum_of(21 + i);
    s.squares = sum_of(27);
    s.squares_sigma = sum_of(28);
    s.weight = sum_of(29);
    s.pixels = static_cast<int>(sum_of(30));
    for (std::size_t k = 0; k < count; ++k)
      if (e2[k] < 400) ++s.residuals[static_cast<std::size_t>(10 * std::sqrt(e2[k]))];
  };
  // Small renders are not worth sharing: most of them are one of many that run side by side.
  constexpr int kWorthSharing = 40000;
  if (render.width * render.height < kWorthSharing)
    for (int begin = 0; begin < render.height; begin += kBandRows)
      band(begin, std::min(render.height, begin + kBandRows));
  else
    parallel_ranges(render.height, kBandRows, band);
  SurfaceSums total;
  for (const SurfaceSums& s : bands) total.add(s);
  return total;
}

Matrix6 SurfaceSums::information() const {
  Matrix6 out;
  std::size_t m = 0;
  for (int a = 0; a < 6; ++a)
    for (int c = a; c < 6; ++c) out(a, c) = out(c, a) = h[m++];
  return out;
}

}  // namespace tribin
