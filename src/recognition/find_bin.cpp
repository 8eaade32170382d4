#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "rim_search.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/pose/refine.hpp"
#include "tribin/pose/systematic_error.hpp"
#include "tribin/pose/verification.hpp"

namespace tribin {
namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

// A hand-eye calibration that does not say how good it is, is taken as a good one.
constexpr double kHandEyeMm = 0.3, kHandEyeRad = 0.03 * kDegree;

// Bins are moulded or welded: their sides keep to about 0.05 % of their length (DIN 16742, TG 6).
constexpr double kShapeSigma = 5e-4;

/// The bin as the fit sees it.
struct BinModel {
  RenderMesh mesh;
  Vec3 middle = Vec3::Zero();  ///< of the inner volume, bin frame
  double lever_mm = 0;         ///< turns radians into mm
  double longest_mm = 0;
};

BinModel model_of(const BinShape& shape) {
  BinModel out;
  out.mesh = make_render_mesh(bin_mesh(shape));
  out.middle = Vec3(0, 0, shape.inner_size_mm.z() / 2);
  // Of a rectangle's area about its middle.
  out.lever_mm = std::hypot(shape.inner_size_mm.x(), shape.inner_size_mm.y()) / std::sqrt(12.0);
  out.longest_mm = std::max(shape.inner_size_mm.x(), shape.inner_size_mm.y());
  return out;
}

/// What the pixels of one piece of the bin say.
struct Counts {
  int supported = 0, violated = 0, hidden = 0, unmeasured = 0;
  int all() const { return supported + violated + hidden + unmeasured; }
};

/// Floor apart from rim and inner walls: any level surface supports the floor.
struct Look {
  Counts floor, sides;
  double spread_mm = 0;  ///< robust sd of what lies near the model, along its normals
  Verification outline;  ///< of the outer edge of the rim: a level surface beyond it is no bin

  double score() const {
    const int all = floor.all() + sides.all();
    return all == 0 ? -1 : (floor.supported + sides.supported - 3.0 * (floor.violated + sides.violated)) / all;
  }
};

/// \param near_mm  what lies within this of the model is on it.
Look look_at(const BinModel& model, const SceneDepth& scene, const Pose& pose, int step, double near_mm) {
  IndexRender render;
  render_index(model.mesh, scene.camera, pose, step, render);
  Look out;
  std::vector<float> residuals;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t k = render.triangle[render.index(i, j)];
      if (k < 0) continue;
      // Of bin_mesh: two triangles of floor, eight each of inner walls and rim; then outer walls and the underside,
      // which tell of a table as well.
      if (k >= 18) continue;
      Counts& counts = k < 2 ? out.floor : out.sides;
      const int u = render.u0 + i * step, v = render.v0 + j * step;
      const double z = scene.z_mm(u, v), z_model = 1.0 / render.inverse_z[render.index(i, j)];
      if (!(z > 0)) {
        ++counts.unmeasured;
        continue;
      }
      const Vec3f& n = render.normal[static_cast<std::size_t>(k)];
      const Vec3 ray = scene.camera.ray(u, v);
      const double r = (z - z_model) * (n[0] * ray.x() + n[1] * ray.y() + n[2] * ray.z());  // > 0: before the surface
      if (std::abs(r) < near_mm) {
        ++counts.supported;
        residuals.push_back(static_cast<float>(std::abs(r)));
      } else if (r > 0) {
        ++counts.hidden;
      } else if (!scene.near_break(u, v)) {
        ++counts.violated;
      }
    }
  if (!residuals.empty()) {
    std::nth_element(residuals.begin(), residuals.begin() + residuals.size() / 2, residuals.end());
    out.spread_mm = 1.4826 * residuals[residuals.size() / 2];
  }
  VerificationOptions options;
  options.step_px = step;
  options.tolerance_mm = near_mm;
  options.diameter_mm = model.longest_mm;
  out.outline = verify_pose(model.mesh, scene, pose, options);
  return out;
}

Refinement fitted(const BinModel& model, const SceneDepth& scene, const Pose& start, int step, double start_scale_mm,
                  int iterations) {
  RefineOptions options;
  options.iterations = iterations;
  options.step_px = step;
  options.start_scale_mm = start_scale_mm;
  options.center = model.middle;
  options.lever_mm = model.lever_mm;
  options.outlines = true;  // walls are seen too flat to be measured, mostly: rim and floor slide without them
  // Beyond it the fit would tell less than where a bin stands without looking.
  options.weak_mm = 0.01 * model.longest_mm;
  return refine_pose(model.mesh, scene, start, options);
}

int step_of(const SceneDepth& scene, double pixels) {
  return std::max(1, static_cast<int>(std::lround(std::sqrt(scene.z_mm.size() / pixels))));
}

/// The turns about z that leave the box as it is.
std::vector<Pose> turns_of(const BinShape& shape) {
  std::vector<Pose> out;
  const bool square = shape.inner_size_mm.x() == shape.inner_size_mm.y();
  for (int quarter = 0; quarter < 4; quarter += square ? 1 : 2) {
    Pose turn = Pose::Identity();
    turn.linear() = Eigen::AngleAxisd(quarter * kPi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    out.push_back(turn);
  }
  return out;
}

Pose nearest_turn(const BinShape& shape, const Pose& pose, const std::optional<Pose>& given) {
  Pose best = pose;
  double nearest = 1e9;
  for (const Pose& turn : turns_of(shape)) {
    const Pose other = pose * turn;
    const double angle = given ? rotation_angle(other.linear(), given->linear())
                               : std::acos(std::clamp(other.linear()(0, 0), -1.0, 1.0));
    if (angle < nearest - 1e-9) nearest = angle, best = other;
  }
  return best;
}

/// The moments of a motion of the middle (mm, rad) that a motion of the camera makes, the middle being at `at`.
Mat6 moved_by_camera(const Vec3& at, double sigma_mm, double sigma_rad) {
  Mat6 j = Mat6::Identity();
  j.topRightCorner<3, 3>() << 0, at.z(), -at.y(), -at.z(), 0, at.x(), at.y(), -at.x(), 0;
  Vec6 variance;
  variance << Vec6::Constant(sigma_mm * sigma_mm);
  variance.tail<3>().setConstant(sigma_rad * sigma_rad);
  return j * variance.asDiagonal() * j.transpose();
}

/// Of the fit, about the middle: noise, the sensor's smooth errors, and how the bin differs from its model.
Mat6 covariance_of(const BinModel& model, const SceneDepth& scene, const Refinement& fit, int step) {
  Vec6 scale;
  scale << 1, 1, 1, 1 / model.lever_mm, 1 / model.lever_mm, 1 / model.lever_mm;
  const Mat6 h = scale.asDiagonal() * Mat6(fit.information) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(h);
  const double inflation = std::max(1.0, fit.rms_sigma * fit.rms_sigma);
  const double least = 1 / (model.longest_mm * model.longest_mm);
  Mat6 held = Mat6::Zero();
  for (int k = 0; k < 6; ++k)
    held += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose() /
            std::max(least, eigen.eigenvalues()(k) / inflation);
  const Vec3 at = fit.camera_from_part * model.middle;
  const Mat6 pull = scale.asDiagonal() *
                    Mat6(pull_of_systematic_errors(model.mesh, scene, fit.camera_from_part, scene.surfels->scan->noise,
                                                   at, step, 0)) *
                    scale.asDiagonal();
  const double shape = kShapeSigma * model.longest_mm;
  const Mat6 c = held + held * pull * held / (inflation * inflation) + shape * shape * Mat6::Identity();
  return scale.asDiagonal() * c * scale.asDiagonal();
}

/// (motion of the middle, w) -> (of the origin, w).
Mat6 about_origin(const Mat6& covariance, const Pose& pose, const Vec3& middle) {
  const Vec3 arm = pose.linear() * -middle;
  Mat6 j = Mat6::Identity();
  j.topRightCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  return j * covariance * j.transpose();
}

void measure_drift(const KnownBin& known, const BinModel& model, const Mat6& fit_covariance, BinSighting& out) {
  const Pose& given = *known.camera_from_bin;
  const Vec3 at = out.camera_from_bin * model.middle;
  Vec6 d;
  d << at - given * model.middle,
      vector_from_rotation(Matrix3(out.camera_from_bin.linear() * given.linear().transpose()));
  out.drift_mm = d.head<3>().norm();
  out.drift_rad = d.tail<3>().norm();
  const Mat6 c = fit_covariance + moved_by_camera(at, known.sigma_mm > 0 ? known.sigma_mm : kHandEyeMm,
                                                  known.sigma_rad > 0 ? known.sigma_rad : kHandEyeRad);
  out.drift_sigma = std::sqrt(d.dot(c.ldlt().solve(d)));
}

std::string percent(const char* format, double share, double wanted) {
  char text[160];
  std::snprintf(text, sizeof text, format, 100 * share, 100 * wanted);
  return text;
}

/// Why a fitted pose is no sight of the bin; empty = it is.
std::string doubt(const Look& look) {
  const double sides = look.sides.all();
  // A quarter of rim and walls: one long side of four. Less could be any edge.
  constexpr double kLeastSides = 0.15;
  if (look.sides.supported < kLeastSides * std::max(1.0, sides))
    return percent("%.0f %% of the rim and walls are seen where they should be, wanted %.0f %%",
                   look.sides.supported / std::max(1.0, sides), kLeastSides);
  constexpr double kMostViolated = 0.15;
  for (const Counts* c : {&look.sides, &look.floor}) {
    const int judged = c->supported + c->violated;
    if (c->violated > kMostViolated * judged)
      return (c == &look.floor ? std::string("its floor: ") : std::string("its rim and walls: ")) +
             percent("the camera sees through %.0f %% of what it can see of them, wanted at most %.0f %%",
                     double(c->violated) / judged, kMostViolated);
  }
  // Half of what is seen of the outer edge ends there. Where the image shows none of it, the floor has to be seen.
  constexpr double kLeastBreaks = 0.5;
  constexpr int kFewestSamples = 20;
  if (look.outline.outline >= kFewestSamples) {
    if (look.outline.contour() < kLeastBreaks)
      return percent("at %.0f %% of the rim's outer edge the surface ends, wanted %.0f %%", look.outline.contour(),
                     kLeastBreaks);
  } else if (look.floor.supported < kLeastSides * look.floor.all()) {
    return "neither the outer edge of its rim nor its floor is seen";
  }
  return {};
}

}  // namespace

BinSighting find_bin(const KnownBin& known, const Surfels& surfels, const PrimitiveModel& observation) {
  const SceneDepth scene = make_scene_depth(*surfels.scan, surfels);
  const BinModel model = model_of(known.shape);
  BinSighting out;
  out.shape = known.shape;
  std::vector<Pose> starts;
  if (known.camera_from_bin) starts.push_back(*known.camera_from_bin);
  for (const RimHypothesis& h : seek_rim(known.shape, surfels, observation, known.camera_from_bin))
    // Farther than half of the shorter side is another bin, or nothing to go by.
    if (!known.camera_from_bin || (h.camera_from_bin * model.middle - *known.camera_from_bin * model.middle).norm() <
                                      0.5 * std::min(known.shape.inner_size_mm.x(), known.shape.inner_size_mm.y()))
      starts.push_back(h.camera_from_bin);
  // A bin that does not open towards the camera shows no inside.
  std::erase_if(starts, [&](const Pose& start) {
    const Eigen::Vector3d to_camera = -(start * model.middle).normalized();
    return to_camera.dot(start.linear().col(2)) < std::cos(60 * kDegree);
  });
  if (starts.empty()) {
    out.reason = "no rim of its size stands out in the scan, open towards the camera";
    return out;
  }
  // A start is as far off as a wall is thick; 1 % of the bin is what its own surfaces may be told by.
  const double start_scale = std::max(known.shape.wall_mm, 0.01 * model.longest_mm);
  const double near_mm = 0.01 * model.longest_mm;
  const int coarse = step_of(scene, 30000), fine = step_of(scene, 300000);
  std::vector<Pose> fits(starts.size());
  std::vector<Look> looks(starts.size());
  parallel_each(static_cast<int>(starts.size()), [&](int i) {
    fits[i] = fitted(model, scene, starts[i], coarse, start_scale, 12).camera_from_part;
    looks[i] = look_at(model, scene, fits[i], coarse, near_mm);
  });
  std::size_t best = 0;
  const auto better = [](const Look& a, const Look& b) {
    const bool sure_a = doubt(a).empty(), sure_b = doubt(b).empty();
    return sure_a != sure_b ? sure_a : a.score() > b.score();
  };
  for (std::size_t i = 1; i < looks.size(); ++i)
    if (better(looks[i], looks[best])) best = i;

  const Pose turned = nearest_turn(known.shape, fits[best], known.camera_from_bin);
  const Refinement fit = fitted(model, scene, turned, fine, 0.25 * start_scale, 8);
  const Look look = look_at(model, scene, fit.camera_from_part, fine, near_mm);
  out.camera_from_bin = fit.camera_from_part;
  out.reason = doubt(look);
  out.found = out.reason.empty();
  out.tolerance_mm = 4 * std::max(look.spread_mm, 0.3 * scene.median_sigma_mm);
  const Mat6 covariance = covariance_of(model, scene, fit, fine);
  out.covariance = about_origin(covariance, out.camera_from_bin, model.middle);
  if (!out.found) return out;
  if (known.camera_from_bin) measure_drift(known, model, covariance, out);
  out.fill = fill_of(out, *surfels.scan);
  return out;
}

}  // namespace tribin
