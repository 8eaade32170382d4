#include "weak_directions.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "render_scores.hpp"

namespace tribin {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

// What the raster and edges a fraction of a pixel off change a likelihood by: less is no fall. Eight nats are four
// sigma.
constexpr double kRaster = 3, kFall = 8;

/// The likelihood of the scan along one direction of the pose; offsets in mm (radians times the lever).
class Profile {
 public:
  Profile(const Part& part, const SceneDepth& scene, const Pose& pose, const Vec6& delta, int step_px)
      : part_(part), scene_(scene), pose_(pose), center_(pose * part.box_center()), delta_(delta), step_px_(step_px) {}

  Pose at(double offset) const { return moved_about(pose_, center_, Vector6(delta_ * offset)); }

  std::vector<double> likelihood(std::span<const double> offsets) const {
    return render_scores(scene_, part_, Detail::full, poses_at(offsets), step_px_);
  }
  std::vector<double> against(std::span<const double> offsets) const {
    return contradictions(scene_, part_, Detail::full, poses_at(offsets), step_px_);
  }

 private:
  std::vector<Pose> poses_at(std::span<const double> offsets) const {
    std::vector<Pose> poses;
    for (const double s : offsets) poses.push_back(at(s));
    return poses;
  }

  const Part& part_;
  const SceneDepth& scene_;
  Pose pose_;
  Vec3 center_;
  Vec6 delta_;
  int step_px_;
};

struct Peak {
  double offset = 0;
  double sigma = 0;  ///< 0 = the likelihood does not fall on both sides
  double gain = 0;   ///< over offset 0 [nats]
};

/// \param reach, pixel  how far is looked [mm], and what a pixel is there.
Peak find_peak(const Profile& profile, double reach, double pixel) {
  // A ladder from half a pixel outwards, both ways; then halves of the step about the best.
  std::vector<double> offsets = {0};
  for (double s = 0.5 * pixel; s < reach; s *= 1.6)
    for (const double sign : {-1.0, 1.0}) offsets.push_back(sign * s);
  const std::vector<double> ladder = profile.likelihood(offsets);
  const double start = ladder[0];
  Peak out;
  double best = start, around = 0.5 * pixel;
  for (std::size_t i = 1; i < offsets.size(); ++i)
    if (ladder[i] > best) {
      best = ladder[i];
      out.offset = offsets[i];
      around = 0.4 * std::abs(offsets[i]);
    }
  for (; around > 0.05 * pixel; around *= 0.5) {
    const std::vector<double> sides = {out.offset - around, out.offset + around};
    const std::vector<double> there = profile.likelihood(sides);
    const std::size_t side = there[1] > there[0] ? 1 : 0;
    if (there[side] <= best) continue;
    best = there[side];
    out.offset = sides[side];
  }
  out.gain = best - start;
  // How far to both sides until the scan contradicts it. The likelihood itself also falls where the part slides below
  // what hides it, and that says nothing of its place.
  double wide = 0;
  for (const double sign : {-1.0, 1.0}) {
    std::vector<double> outwards = {out.offset};
    for (double s = 0.25 * pixel; s < reach; s *= 1.6) outwards.push_back(out.offset + sign * s);
    const std::vector<double> there = profile.against(outwards);
    std::size_t i = 1;
    while (i < there.size() && there[i] < there[0] + kFall) ++i;
    if (i == there.size()) return out;
    wide = std::max(wide, std::abs(outwards[i] - out.offset));
  }
  out.sigma = wide / std::sqrt(2 * kFall);
  return out;
}

}  // namespace

void settle_weak_directions(const Part& part, const SceneDepth& scene, std::span<const Vector6> frozen, int step_px,
                            Refinement& refined) {
  const double pixel = (refined.camera_from_part * part.box_center()).z() / scene.camera.fx;
  const Vec6 scale = scale_of_motion(part.gyration_mm);
  const Mat6 keep = off_directions(frozen, Vector6(scale));
  const Mat6 h = keep * Mat6(scale.asDiagonal() * Mat6(refined.information) * scale.asDiagonal()) * keep;
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(h);
  // An outline's precision is a tenth of a pixel: what is held so well needs no second look.
  const double enough = 0.1 * pixel;
  constexpr int kMost = 2;
  for (int k = static_cast<int>(frozen.size()); k < std::min<int>(6, static_cast<int>(frozen.size()) + kMost); ++k) {
    const double information = std::max(eigen.eigenvalues()(k), 1e-300);
    if (information > 1 / (enough * enough)) break;
    const Vec6 direction = eigen.eigenvectors().col(k);
    const Profile profile(part, scene, refined.camera_from_part, scale.cwiseProduct(direction), step_px);
    const Peak peak = find_peak(profile, 0.04 * part.diameter_mm, pixel);
    if (peak.gain > kRaster) refined.camera_from_part = profile.at(peak.offset);
    if (peak.sigma <= 0) continue;
    const double sigma = std::max(peak.sigma, enough);
    const Vec6 covector = direction.cwiseQuotient(scale);
    refined.information = Matrix6(Mat6(refined.information) + covector * covector.transpose() / (sigma * sigma));
  }
}

}  // namespace tribin
