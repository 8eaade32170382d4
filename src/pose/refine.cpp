#include "tribin/pose/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>

#include "inside_silhouette.hpp"
#include "move_render.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/core/vector_levels.hpp"
#include "tribin/pose/contour.hpp"

namespace tribin {
namespace {

/// The normal equations of one band of rows.
struct Sums {
  std::array<double, 21> h{};
  std::array<double, 6> b{};
  double squares = 0, squares_sigma = 0, weight = 0;
  int pixels = 0;
  std::array<int, 200> residuals{};  ///< histogram of |residual| in tenths of sigma, for their median

  void add(const Sums& o) {
    for (std::size_t i = 0; i < h.size(); ++i) h[i] += o.h[i];
    for (std::size_t i = 0; i < b.size(); ++i) b[i] += o.b[i];
    squares += o.squares;
    squares_sigma += o.squares_sigma;
    weight += o.weight;
    pixels += o.pixels;
    for (std::size_t i = 0; i < residuals.size(); ++i) residuals[i] += o.residuals[i];
  }

  /// Robust sd of the residuals in sigmas: 1.48 times their median; 1 when the noise alone explains them.
  double spread() const {
    int all = 0, sum = 0;
    for (const int n : residuals) all += n;
    for (std::size_t i = 0; i < residuals.size(); ++i)
      if (2 * (sum += residuals[i]) > all) return 1.4826 * 0.1 * (static_cast<double>(i) + 0.5);
    return 1;
  }
};

constexpr int kBandRows = 16;

constexpr std::size_t kLanes = 16;

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
    float w[kLanes], robust[kLanes], rr[kLanes], in[kLanes];
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
      rr[l] = x;
    }
    float* out = sums;
    for (std::size_t a = 0; a < 6; ++a) {
      float wa[kLanes];
      for (std::size_t l = 0; l < kLanes; ++l) wa[l] = w[l] * jacobian[a * stride + k + l];
      for (std::size_t c = a; c < 6; ++c, out += kLanes)
        for (std::size_t l = 0; l < kLanes; ++l) out[l] += wa[l] * jacobian[c * stride + k + l];
    }
    for (std::size_t a = 0; a < 6; ++a, out += kLanes)
      for (std::size_t l = 0; l < kLanes; ++l) out[l] += w[l] * jacobian[a * stride + k + l] * rr[l];
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += robust[l] > 0 ? robust[l] * rr[l] * rr[l] : 0;
    out += kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += robust[l] > 0 ? robust[l] * e2[k + l] : 0;
    out += kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += robust[l];
    out += kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] += in[l];
  }
}

/// The points of some rows of a render.
void gather_points(const SceneDepth& scene, const IndexRender& render, const Eigen::Vector3d& center,
                   double cad_sigma_mm, int begin, int end, Points& out) {
  const PinholeCamera& camera = scene.camera;
  const auto cx = static_cast<float>(center.x()), cy = static_cast<float>(center.y()),
             cz = static_cast<float>(center.z());
  const auto cad_variance = static_cast<float>(cad_sigma_mm * cad_sigma_mm);
  for (int j = begin; j < end; ++j) {
    const int v = render.v0 + j * render.step;
    const auto ry = static_cast<float>((v - camera.cy) / camera.fy);
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t k = render.triangle[render.index(i, j)];
      if (k < 0) continue;
      const int u = render.u0 + i * render.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j)) continue;
      const auto rx = static_cast<float>((u - camera.cx) / camera.fx);
      const Vec3f& n = render.normal[static_cast<std::size_t>(k)];
      const float along = n[0] * rx + n[1] * ry + n[2];  // n . ray, negative
      const float sigma = scene.sigma_mm(u, v) * along;
      const float px = rx * z - cx, py = ry * z - cy, pz = z - cz;
      out.add((z - 1 / render.inverse_z[render.index(i, j)]) * along, sigma * sigma + cad_variance,
              {n[0], n[1], n[2], py * n[2] - pz * n[1], pz * n[0] - px * n[2], px * n[1] - py * n[0]});
    }
  }
}

Sums accumulate(const SceneDepth& scene, const IndexRender& render, const Eigen::Vector3d& center, double scale_mm,
                double cad_sigma_mm, double kernel_sigmas, bool final_pass) {
  std::vector<Sums> bands(static_cast<std::size_t>((render.height + kBandRows - 1) / kBandRows));
  const auto band = [&](int begin, int end) {
    thread_local Points points;
    points.clear(static_cast<std::size_t>(render.width) * static_cast<std::size_t>(end - begin));
    gather_points(scene, render, center, cad_sigma_mm, begin, end, points);
    const std::size_t count = points.count;
    while (points.count % kLanes) points.add(1e15f, 1, {});  // so far off that it weighs nothing
    std::array<float, kSums * kLanes> lanes{};
    float* e2 = points.field(Points::kE2);
    weigh_points(points.field(Points::kResidual), points.field(Points::kVariance), points.field(Points::kJacobian),
                 points.stride, points.count, static_cast<float>(scale_mm * scale_mm),
                 static_cast<float>(kernel_sigmas * kernel_sigmas), final_pass, e2, lanes.data());
    const auto sum_of = [&](std::size_t s) {
      double sum = 0;
      for (std::size_t l = 0; l < kLanes; ++l) sum += static_cast<double>(lanes[s * kLanes + l]);
      return sum;
    };
    Sums& s = bands[static_cast<std::size_t>(begin / kBandRows)];
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
  Sums total;
  for (const Sums& s : bands) total.add(s);
  return total;
}

Matrix6 matrix_from(const Sums& s) {
  Matrix6 h;
  std::size_t m = 0;
  for (int a = 0; a < 6; ++a)
    for (int c = a; c < 6; ++c) h(a, c) = h(c, a) = s.h[m++];
  return h;
}

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// Normal equations in coordinates where radians count `lever` mm, without the frozen directions.
struct System {
  Mat6 h;
  Vec6 b;
};

System scaled(const Matrix6& h, const Vector6& b, const std::vector<Vector6>& frozen, const Vec6& scale) {
  System s{scale.asDiagonal() * Mat6(h) * scale.asDiagonal(), scale.asDiagonal() * Vec6(b)};
  const Mat6 keep = off_directions(frozen, Vector6(scale));
  s.h = keep * s.h * keep;
  s.b = keep * s.b;
  return s;
}

/// Directions that the data holds to less than `weak_mm` stay where they are, and so do those with less than a
/// millionth of the best one's information: a step along them would follow noise and local minima.
Vec6 solve(const System& s, double weak_mm) {
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(s.h);
  const double limit =
      std::max(1e-6 * std::max(eigen.eigenvalues()(5), 1e-300), weak_mm > 0 ? 1 / (weak_mm * weak_mm) : 0.0);
  Vec6 x = Vec6::Zero();
  for (int k = 0; k < 6; ++k)
    if (eigen.eigenvalues()(k) > limit)
      x += eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(s.b) / eigen.eigenvalues()(k));
  return x;
}

// Mixed pixels and the raster shift whole outlines by about a tenth of a pixel, which no number of samples averages
// away: an outline holds no direction better than that, at the end. Before, it may pull with all its weight, so that it
// carries the pose over the local minima of surfaces that say little.
constexpr double kOutlineBiasPx = 0.1;
constexpr double kEdgeReachPx = 6;

/// Adds the outline's equations, bounded to a precision of `bias_mm` (0 = unbounded).
void add_outlines(Matrix6& information, Vector6& b, const ContourSums& edges, const std::vector<Vector6>& frozen,
                  const Vec6& scale, double bias_mm) {
  if (edges.samples < 12) return;
  const System outline = scaled(edges.information, edges.pull, frozen, scale);
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(outline.h);
  const double share = bias_mm > 0 ? std::min(1.0, 1 / (eigen.eigenvalues()(5) * bias_mm * bias_mm)) : 1.0;
  information += edges.information * share;
  b += edges.pull * share;
}

/// How far a motion carries the part's surface at most, nearly: its rim is two radii of gyration away [mm].
double reach_of_motion(const Pose& a, const Pose& b, const RefineOptions& options) {
  const Eigen::Vector3d c = options.center;
  return (a * c - b * c).norm() + 2 * options.lever_mm * rotation_angle(a.linear(), b.linear());
}

}  // namespace

Vector6 scale_of_motion(double lever_mm) {
  Vector6 scale;
  scale << 1, 1, 1, 1 / lever_mm, 1 / lever_mm, 1 / lever_mm;
  return scale;
}

Matrix6 off_directions(std::span<const Vector6> directions, const Vector6& scale) {
  Mat6 keep = Mat6::Identity();
  for (const Vector6& direction : directions) {
    Vec6 d = keep * Vec6(direction).cwiseQuotient(Vec6(scale));
    if (d.norm() < 1e-12) continue;
    d.normalize();
    keep -= d * d.transpose();
  }
  return Matrix6(keep);
}

Refinement refine_pose(const RenderMesh& mesh, const SceneDepth& scene, const Pose& start,
                       const RefineOptions& options) {
  Refinement out;
  out.camera_from_part = start;
  thread_local IndexRender render;
  ContourSums edges;
  Pose rendered_at = start;
  // The kernel ends at 3 local sigma (accumulate); the schedule falls below that everywhere.
  const double end_scale = 3 * std::hypot(0.3 * scene.median_sigma_mm, options.cad_sigma_mm);
  const double ratio =
      std::pow(std::max(1.0, options.start_scale_mm / end_scale), 1.0 / std::max(1, options.iterations - 2));
  double scale = options.start_scale_mm;
  double kernel = options.kernel_sigmas;
  const Vec6 scale6 = scale_of_motion(options.lever_mm);
  for (int it = 0; it <= options.iterations; ++it) {
    const bool final_pass = it == options.iterations;
    const Eigen::Vector3d center = out.camera_from_part * Eigen::Vector3d(options.center);
    // While the pose moves by less than a quarter of a rendered pixel, each pixel keeps its facet, and each sample of
    // the outline its edge in the scan: the outline's equations move with the pose.
    const double pixel_mm = options.step_px * center.z() / scene.camera.fx;
    const double moved_mm = it == 0 ? 1e30 : reach_of_motion(rendered_at, out.camera_from_part, options);
    if (moved_mm > 0.25 * pixel_mm) {
      render_index(mesh, scene.camera, out.camera_from_part, options.step_px, render);
      rendered_at = out.camera_from_part;
      if (options.outlines) edges = contour_sums(mesh, scene, out.camera_from_part, render, Vec3(center), kEdgeReachPx);
    } else {
      move_render(mesh, scene.camera, out.camera_from_part, render);
    }
    const Sums sums = accumulate(scene, render, center, final_pass ? end_scale : std::max(scale, end_scale),
                                 options.cad_sigma_mm, kernel, final_pass);
    // Pixels nearer than the noise's correlation count once.
    const double independent =
        1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(render.step) * render.step));
    out.information = matrix_from(sums) * independent;
    out.pixels = sums.pixels;
    out.rms_mm = sums.weight > 0 ? std::sqrt(sums.squares / sums.weight) : 0;
    out.rms_sigma = sums.weight > 0 ? std::sqrt(sums.squares_sigma / sums.weight) : 0;
    if (sums.pixels < 12) break;
    // A sensor whose errors on this part are larger than its noise elsewhere (shine, warp) gets a wider kernel, else
    // whole faces would be dropped in favour of others. Four times, because beyond that it is no longer the same
    // surface.
    kernel = options.kernel_sigmas * std::clamp(sums.spread(), 1.0, 4.0);
    Vector6 b;
    for (int a = 0; a < 6; ++a) b[a] = sums.b[static_cast<std::size_t>(a)] * independent;
    if (options.outlines) {
      const bool settling = it + 2 < options.iterations;
      add_outlines(out.information, b, edges, options.frozen, scale6,
                   settling ? 0 : kOutlineBiasPx * center.z() / scene.camera.fx);
    }
    if (final_pass) break;
    const double spread = kernel / options.kernel_sigmas;
    const Vec6 step =
        scale6.cwiseProduct(solve(scaled(out.information, b, options.frozen, scale6), options.weak_mm / spread));
    Vector6 delta(step);
    // A step may not outrun the association: at most the current scale's reach.
    const double length = std::max(delta.head<3>().norm(), delta.tail<3>().norm() * options.lever_mm);
    const double reach = 4 * std::max(scale, end_scale);
    if (length > reach) delta *= reach / length;
    out.camera_from_part = moved_about(out.camera_from_part, center, delta);
    edges.pull -= edges.information * delta;
    scale /= ratio;
    if (length < 1e-5 && scale <= end_scale) {
      // Converged: what is left is the final pass.
      it = options.iterations - 1;
    }
  }
  return out;
}

}  // namespace tribin
