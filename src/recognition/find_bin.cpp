#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "rim_place.hpp"
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
constexpr double kHandEyeMm = 0.25, kHandEyeRad = 0.02 * kDegree;

// Bins are moulded or welded: their sides keep to about 0.05 % of their length (DIN 16742, TG 6).
constexpr double kShapeSigma = 5e-4;

// Triangles of bin_mesh: floor, inner walls, rim; then outer walls and the underside, which tell of a table as well.
constexpr int kFloorEnd = 2, kWallsEnd = 10, kRimEnd = 18;

/// The bin as the fit sees it.
struct BinModel {
  BinShape shape;
  RenderMesh mesh;
  RenderMesh level;                ///< floor and rim alone: walls are seen so flat that they are measured badly
  Vec3 middle = Vec3::Zero();      ///< of the inner volume, bin frame
  Vec3 rim_middle = Vec3::Zero();  ///< of the rim
  double lever_mm = 0;             ///< turns radians into mm
  double longest_mm = 0;
  double near_mm = 0;         ///< what lies within this of the model is on it: 1 % of its longest side
  double start_scale_mm = 0;  ///< how far a start may be off: a wall, or as much
};

BinModel model_of(const BinShape& shape) {
  BinModel out;
  out.shape = shape;
  Mesh mesh = bin_mesh(shape);
  out.mesh = make_render_mesh(mesh);
  const std::vector<std::array<std::uint32_t, 3>> all = mesh.triangles;
  mesh.triangles.assign(all.begin(), all.begin() + kFloorEnd);
  mesh.triangles.insert(mesh.triangles.end(), all.begin() + kWallsEnd, all.begin() + kRimEnd);
  out.level = make_render_mesh(mesh);
  out.middle = Vec3(0, 0, shape.inner_size_mm.z() / 2);
  out.rim_middle = Vec3(0, 0, shape.inner_size_mm.z());
  // Of a rectangle's area about its middle.
  out.lever_mm = std::hypot(shape.inner_size_mm.x(), shape.inner_size_mm.y()) / std::sqrt(12.0);
  out.longest_mm = std::max(shape.inner_size_mm.x(), shape.inner_size_mm.y());
  out.near_mm = 0.01 * out.longest_mm;
  out.start_scale_mm = std::max(shape.wall_mm, out.near_mm);
  return out;
}

/// What the pixels of one piece of the bin say.
struct Counts {
  int supported = 0, violated = 0, hidden = 0, unmeasured = 0;
  int all() const { return supported + violated + hidden + unmeasured; }
  void add(const Counts& o) {
    supported += o.supported, violated += o.violated, hidden += o.hidden, unmeasured += o.unmeasured;
  }
};

/// Floor apart from the rim: any level surface supports the floor.
struct Look {
  Counts floor, walls, rim;
  std::array<Counts, 4> rim_sides;  ///< the rim side by side
  double rim_in_view = 0;           ///< share of the rim that lies in the image
  double spread_mm = 0;             ///< robust sd of what lies near the model, along its normals
  Verification outline;             ///< of the outer edge of the rim: a level surface beyond it is no bin

  double score() const {
    const int violated = floor.violated + walls.violated + rim.violated;
    return (rim.supported + 0.2 * (floor.supported + walls.supported) - 3.0 * violated) / std::max(1, rim.all()) *
           rim_in_view;
  }
};

double share_in_view(const BinShape& shape, const PinholeCamera& camera, const Pose& pose) {
  const double x = (shape.inner_size_mm.x() + shape.wall_mm) / 2, y = (shape.inner_size_mm.y() + shape.wall_mm) / 2;
  constexpr int kSamples = 64;
  int inside = 0;
  for (int k = 0; k < kSamples; ++k) {
    const double t = 2.0 * (k % 16 + 0.5) / 16 - 1;
    const Eigen::Vector2d on =
        k < 32 ? Eigen::Vector2d(k < 16 ? x : -x, t * y) : Eigen::Vector2d(t * x, k < 48 ? y : -y);
    const Vec3 p = pose * Vec3(on.x(), on.y(), shape.inner_size_mm.z());
    if (!(p.z() > 0)) continue;
    const Vec2 q = camera.project(p);
    inside += q.x() >= 0 && q.y() >= 0 && q.x() < camera.width && q.y() < camera.height;
  }
  return double(inside) / kSamples;
}

Look look_at(const BinModel& model, const SceneDepth& scene, const Pose& pose, int step) {
  IndexRender render;
  render_index(model.mesh, scene.camera, pose, step, render);
  Look out;
  out.rim_in_view = share_in_view(model.shape, scene.camera, pose);
  std::vector<float> residuals;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t k = render.triangle[render.index(i, j)];
      if (k < 0) continue;
      if (k >= kRimEnd) continue;
      Counts& counts = k < kFloorEnd   ? out.floor
                       : k < kWallsEnd ? out.walls
                                       : out.rim_sides[static_cast<std::size_t>(k - kWallsEnd) / 2];
      const int u = render.u0 + i * step, v = render.v0 + j * step;
      const double z = scene.z_mm(u, v), z_model = 1.0 / render.inverse_z[render.index(i, j)];
      if (!(z > 0)) {
        ++counts.unmeasured;
        continue;
      }
      const Vec3f& n = render.normal[static_cast<std::size_t>(k)];
      const Vec3 ray = scene.camera.ray(u, v);
      const double r = (z - z_model) * (n[0] * ray.x() + n[1] * ray.y() + n[2] * ray.z());  // > 0: before the surface
      if (std::abs(r) < model.near_mm) {
        ++counts.supported;
        residuals.push_back(static_cast<float>(std::abs(r)));
      } else if (r > 0) {
        ++counts.hidden;
      } else if (!scene.near_break(u, v)) {
        ++counts.violated;
      }
    }
  for (const Counts& side : out.rim_sides) out.rim.add(side);
  if (!residuals.empty()) {
    std::nth_element(residuals.begin(), residuals.begin() + residuals.size() / 2, residuals.end());
    out.spread_mm = 1.4826 * residuals[residuals.size() / 2];
  }
  VerificationOptions options;
  options.step_px = step;
  options.tolerance_mm = model.near_mm;
  options.diameter_mm = model.longest_mm;
  out.outline = verify_pose(model.mesh, scene, pose, options);
  return out;
}

/// A pose on the scan, with the information that holds it.
struct BinFit {
  Pose camera_from_bin = Pose::Identity();
  Matrix6 information = Matrix6::Zero();  ///< as of Refinement
  double rms_sigma = 0;
};

/// Height and tilt by rim and floor; place and turn in the rim's plane by the rim. The one moves about the rim's
/// middle, so that it does not spoil the other.
BinFit fitted(const BinModel& model, const SceneDepth& scene, const Pose& start, int step, double start_scale_mm) {
  BinFit out;
  const Scan& scan = *scene.surfels->scan;
  const int rim_step = std::max(1, step / 2);
  out.camera_from_bin = place_on_rim(model.shape, scan, start, start_scale_mm, rim_step).camera_from_bin;
  for (const double reach : {0.5 * start_scale_mm, 0.1 * start_scale_mm}) {
    RefineOptions options;
    options.iterations = 8;
    options.step_px = step;
    options.start_scale_mm = 2 * reach;
    options.center = model.rim_middle;
    options.lever_mm = model.lever_mm;
    // Beyond it the fit would tell less than where a bin stands without looking.
    options.weak_mm = model.near_mm;
    const Eigen::Matrix3d axes = out.camera_from_bin.linear();
    Eigen::Matrix<double, 6, 3> in_plane = Eigen::Matrix<double, 6, 3>::Zero();
    in_plane.topLeftCorner<3, 2>() = axes.leftCols<2>();
    in_plane.bottomRightCorner<3, 1>() = axes.col(2);
    for (int k = 0; k < 3; ++k) options.frozen.push_back(Vector6(in_plane.col(k)));
    const Refinement fit = refine_pose(model.level, scene, out.camera_from_bin, options);
    const RimPlace place = place_on_rim(model.shape, scan, fit.camera_from_part, reach, rim_step);
    out.camera_from_bin = place.camera_from_bin;
    const Mat6 keep = Mat6::Identity() - in_plane * in_plane.transpose();
    out.information = keep * Mat6(fit.information) * keep + in_plane * place.information * in_plane.transpose();
    out.rms_sigma = fit.rms_sigma;
  }
  return out;
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

/// Of the fit, about the rim's middle: noise, the sensor's smooth errors, and how the bin differs from its model.
Mat6 covariance_of(const BinModel& model, const SceneDepth& scene, const BinFit& fit, int step) {
  const Vec6 scale = scale_of_motion(model.lever_mm);
  const Mat6 h = scale.asDiagonal() * Mat6(fit.information) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(h);
  const double inflation = std::max(1.0, fit.rms_sigma * fit.rms_sigma);
  const double least = 1 / (model.longest_mm * model.longest_mm);
  Mat6 held = Mat6::Zero();
  for (int k = 0; k < 6; ++k)
    held += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose() /
            std::max(least, eigen.eigenvalues()(k) / inflation);
  const Vec3 at = fit.camera_from_bin * model.rim_middle;
  IndexRender render;
  render_index(model.level, scene.camera, fit.camera_from_bin, step, render);
  const Mat6 pull = scale.asDiagonal() *
                    Mat6(common_errors(render, scene, scene.surfels->scan->noise, at, 0).systematic) *
                    scale.asDiagonal();
  const double shape = kShapeSigma * model.longest_mm;
  const Mat6 c = held + held * pull * held / (inflation * inflation) + shape * shape * Mat6::Identity();
  return scale.asDiagonal() * c * scale.asDiagonal();
}

/// (motion of the rim's middle, w) -> (of another point, w).
Mat6 about(const Mat6& covariance, const BinModel& model, const Pose& pose, const Vec3& point) {
  const Vec3 arm = pose.linear() * (point - model.rim_middle);
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
  const Mat6 c = about(fit_covariance, model, out.camera_from_bin, model.middle) +
                 moved_by_camera(at, known.sigma_mm > 0 ? known.sigma_mm : kHandEyeMm,
                                 known.sigma_rad > 0 ? known.sigma_rad : kHandEyeRad);
  out.drift_sigma = std::sqrt(d.dot(c.ldlt().solve(d)));
}

std::string percent(const char* format, double share, double wanted) {
  char text[160];
  std::snprintf(text, sizeof text, format, 100 * share, 100 * wanted);
  return text;
}

/// Why a fitted pose is no sight of the bin; empty = it is.
/// \param given  its place was told: then it may be cut by the image's border.
std::string doubt(const Look& look, bool given) {
  const double least_in_view = given ? 0.25 : 0.75;  // one side of four; all but a corner or two
  if (look.rim_in_view < least_in_view)
    return percent("%.0f %% of its rim would be in the image, wanted %.0f %%", look.rim_in_view, least_in_view);
  constexpr double kLeastRim = 0.25;  // one side of four: less could be any edge
  const double rim = look.rim.supported / std::max(1.0, double(look.rim.all()));
  if (rim < kLeastRim) return percent("%.0f %% of the rim is seen where it should be, wanted %.0f %%", rim, kLeastRim);
  constexpr double kMostViolated = 0.15;
  const std::pair<const Counts*, const char*> pieces[] = {
      {&look.rim, "its rim: "}, {&look.walls, "its walls: "}, {&look.floor, "its floor: "}};
  for (const auto& [counts, name] : pieces) {
    const int judged = counts->supported + counts->violated;
    if (counts->violated > kMostViolated * judged)
      return name + percent("the camera sees through %.0f %% of what it can judge, wanted at most %.0f %%",
                            double(counts->violated) / judged, kMostViolated);
  }
  // Three sides of a bin of another size fit as well.
  constexpr double kMostOfSide = 0.4;
  for (const Counts& side : look.rim_sides)
    if (side.violated > kMostOfSide * (side.supported + side.violated))
      return percent("one side of its rim: the camera sees through %.0f %% of it, wanted at most %.0f %%",
                     double(side.violated) / (side.supported + side.violated), kMostOfSide);
  // Half of what is seen of the outer edge ends there. Where the image shows none of it, the floor has to be seen.
  constexpr double kLeastBreaks = 0.5;
  constexpr int kFewestSamples = 20;
  if (look.outline.outline >= kFewestSamples) {
    if (look.outline.contour() < kLeastBreaks)
      return percent("at %.0f %% of the rim's outer edge the surface ends, wanted %.0f %%", look.outline.contour(),
                     kLeastBreaks);
  } else if (look.floor.supported < kLeastRim * look.floor.all()) {
    return "neither the outer edge of its rim nor its floor is seen";
  }
  return {};
}

/// A pose fitted on few pixels.
struct Attempt {
  Pose pose = Pose::Identity();
  Look look;
  bool sure = false;
};

bool better(const Attempt& a, const Attempt& b) { return a.sure != b.sure ? a.sure : a.look.score() > b.look.score(); }

std::optional<Attempt> best_attempt(const BinModel& model, const SceneDepth& scene, const std::vector<Pose>& starts,
                                    bool given) {
  const int step = step_of(scene, 30000);
  std::vector<Attempt> attempts(starts.size());
  parallel_each(static_cast<int>(starts.size()), [&](int i) {
    const Pose pose = fitted(model, scene, starts[i], step, model.start_scale_mm).camera_from_bin;
    const Look look = look_at(model, scene, pose, step);
    attempts[i] = {pose, look, doubt(look, given).empty()};
  });
  std::optional<Attempt> best;
  for (const Attempt& attempt : attempts)
    if (!best || better(attempt, *best)) best = attempt;
  return best;
}

/// A bin that does not open towards the camera shows no inside.
bool opens_to_camera(const BinModel& model, const Pose& pose) {
  const Eigen::Vector3d to_camera = -(pose * model.middle).normalized();
  return to_camera.dot(pose.linear().col(2)) > std::cos(60 * kDegree);
}

}  // namespace

BinSighting find_bin(const KnownBin& known, const Surfels& surfels, const PrimitiveModel& observation) {
  const SceneDepth scene = make_scene_depth(*surfels.scan, surfels);
  const BinModel model = model_of(known.shape);
  BinSighting out;
  out.shape = known.shape;
  const int fine = step_of(scene, 100000);
  const bool given = known.camera_from_bin.has_value();
  std::optional<Attempt> best;
  if (given && opens_to_camera(model, *known.camera_from_bin))
    best = best_attempt(model, scene, {*known.camera_from_bin}, given);
  // Only a bin that is not where it should be has to be sought.
  if (!best || !best->sure) {
    std::vector<Pose> starts;
    for (const RimHypothesis& h : seek_rim(known.shape, surfels, observation, known.camera_from_bin)) {
      const Pose& pose = h.camera_from_bin;
      // Farther than half of the shorter side is another bin, or nothing to go by.
      const double reach = 0.5 * std::min(known.shape.inner_size_mm.x(), known.shape.inner_size_mm.y());
      const bool near =
          !known.camera_from_bin || (pose * model.middle - *known.camera_from_bin * model.middle).norm() < reach;
      if (near && opens_to_camera(model, pose)) starts.push_back(pose);
    }
    const std::optional<Attempt> sought = best_attempt(model, scene, starts, given);
    if (sought && (!best || better(*sought, *best))) best = sought;
  }
  if (!best) {
    out.reason = "no rim of its size stands out in the scan, open towards the camera";
    return out;
  }
  const Pose turned = nearest_turn(known.shape, best->pose, known.camera_from_bin);
  const BinFit fit = fitted(model, scene, turned, fine, 0.25 * model.start_scale_mm);
  const Look look = look_at(model, scene, fit.camera_from_bin, fine);
  out.camera_from_bin = fit.camera_from_bin;
  out.reason = doubt(look, given);
  out.found = out.reason.empty();
  out.tolerance_mm = 4 * std::max(look.spread_mm, 0.3 * scene.median_sigma_mm);
  const Mat6 covariance = covariance_of(model, scene, fit, fine);
  out.covariance = about(covariance, model, out.camera_from_bin, Vec3::Zero());
  if (!out.found) return out;
  if (given) measure_drift(known, model, covariance, out);
  out.fill = fill_of(out, *surfels.scan);
  return out;
}

}  // namespace tribin
