#include "tribin/pose/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "move_render.hpp"
#include "surface_sums.hpp"
#include "tribin/pose/contour.hpp"

namespace tribin {
namespace {

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
  const ContourSums held = edges.without_common(bias_mm > 0 ? edges.held : 1);
  const System outline = scaled(held.information, held.pull, frozen, scale);
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(outline.h);
  const double share = bias_mm > 0 ? std::min(1.0, 1 / (eigen.eigenvalues()(5) * bias_mm * bias_mm)) : 1.0;
  information += held.information * share;
  b += held.pull * share;
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
  // The kernel ends at 3 local sigma (surface_sums); the schedule falls below that everywhere.
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
    const SurfaceSums sums = surface_sums(scene, render, center, final_pass ? end_scale : std::max(scale, end_scale),
                                          options.cad_sigma_mm, kernel, options.by_patches, final_pass);
    // Pixels nearer than the noise's correlation count once.
    const double independent =
        1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(render.step) * render.step));
    out.information = sums.information() * independent;
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
    edges.move(delta);
    scale /= ratio;
    if (length < 1e-5 && scale <= end_scale) {
      // Converged: what is left is the final pass.
      it = options.iterations - 1;
    }
  }
  return out;
}

}  // namespace tribin
