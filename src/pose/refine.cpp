#include "tribin/pose/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>

#include "inside_silhouette.hpp"
#include "move_render.hpp"
#include "tribin/core/parallel.hpp"
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

Sums accumulate(const SceneDepth& scene, const IndexRender& render, const Eigen::Vector3d& center, double scale_mm,
                double cad_sigma_mm, double kernel_sigmas, bool final_pass) {
  std::vector<Sums> bands(static_cast<std::size_t>((render.height + kBandRows - 1) / kBandRows));
  const PinholeCamera& camera = scene.camera;
  const auto band = [&](int begin, int end) {
    Sums& s = bands[static_cast<std::size_t>(begin / kBandRows)];
    for (int j = begin; j < end; ++j) {
      const int v = render.v0 + j * render.step;
      for (int i = 0; i < render.width; ++i) {
        const std::int32_t k = render.triangle[render.index(i, j)];
        if (k < 0) continue;
        const int u = render.u0 + i * render.step;
        const float z = scene.z_mm(u, v);
        if (!(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j)) continue;
        const double rx = (u - camera.cx) / camera.fx, ry = (v - camera.cy) / camera.fy;
        const Vec3f& nf = render.normal[static_cast<std::size_t>(k)];
        const double nx = nf[0], ny = nf[1], nz = nf[2];
        const double along = nx * rx + ny * ry + nz;  // n . ray, negative
        const double z_model = 1.0 / render.inverse_z[render.index(i, j)];
        const double r = (z - z_model) * along;  // signed distance of the scan point from the facet
        const double sigma_noise = scene.sigma_mm(u, v) * std::abs(along);
        const double variance = sigma_noise * sigma_noise + cad_sigma_mm * cad_sigma_mm;
        const double e2 = r * r / variance;
        if (e2 < 400) ++s.residuals[static_cast<std::size_t>(10 * std::sqrt(e2))];
        const double scale2 = std::max(scale_mm * scale_mm, kernel_sigmas * kernel_sigmas * variance);
        const double g = scale2 / (scale2 + r * r);
        const double robust = g * g;
        if (final_pass && robust < 0.25) continue;
        const double w = (final_pass ? 1.0 : robust) / variance;
        const double px = rx * z - center.x(), py = ry * z - center.y(), pz = z - center.z();
        const std::array<double, 6> jac = {nx, ny, nz, py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx};
        std::size_t m = 0;
        for (std::size_t a = 0; a < 6; ++a) {
          const double wa = w * jac[a];
          s.b[a] += wa * r;
          for (std::size_t c = a; c < 6; ++c) s.h[m++] += wa * jac[c];
        }
        s.squares += robust * r * r;
        s.squares_sigma += robust * r * r / variance;
        s.weight += robust;
        s.pixels += robust > 0.25;
      }
    }
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
