// OpenCV's surface_matching: point-pair features (Drost et al. 2010) with its own ICP. Each part is looked for in the
// whole cloud; of poses that lie at one place the one with most votes is kept. It is given normals and a cloud without
// bin and table.

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/surface_matching.hpp>
#include <opencv2/surface_matching/ppf_helpers.hpp>

#include "peer_io.hpp"

namespace {

namespace ppf = cv::ppf_match_3d;

// Its sample's own settings: model sampled at 0.05 of the diameter, every fifth scene point a reference.
constexpr double kModelStep = 0.05, kSceneStep = 1.0 / 5, kSceneDistance = 0.05;
constexpr std::size_t kRefined = 30;  // poses that ICP gets: more than parts of one class lie in a dense heap
constexpr int kModelPoints = 3000;    // it samples anew at 0.05 of the diameter; ICP takes all that it is given
constexpr int kScenePoints = 30000;
constexpr double kLeastVotesOfBest = 0.3;  // poses with fewer votes than this share of the best are not given out

/// At most about `most` of the points, evenly by their order.
cv::Mat points_of(const std::vector<float>& values, int most) {
  cv::Mat out(0, 6, CV_32F);
  int k = 0, valid = 0;
  for (std::size_t i = 2; i < values.size(); i += 6) valid += std::isfinite(values[i]);
  const int every = std::max(1, valid / most);
  for (std::size_t i = 0; i + 5 < values.size(); i += 6) {
    const float* p = values.data() + i;
    if (!std::isfinite(p[2]) || (p[3] == 0 && p[4] == 0 && p[5] == 0) || k++ % every != 0) continue;
    out.push_back(cv::Mat(1, 6, CV_32F, const_cast<float*>(p)));
  }
  return out;
}

double diameter(const cv::Mat& points) {
  double low[3], high[3], sum = 0;
  for (int i = 0; i < 3; ++i) {
    cv::minMaxLoc(points.col(i), &low[i], &high[i]);
    sum += (high[i] - low[i]) * (high[i] - low[i]);
  }
  return std::sqrt(sum);
}

}  // namespace

int main(int argc, char** argv) {
  const peer::Request r = peer::read_request(argc, argv);
  cv::setNumThreads(1);
  const std::vector<float> raw = peer::read_floats(r.cloud, 6 * static_cast<std::size_t>(r.width) * r.height);
  std::vector<cv::Mat> models;
  for (const std::string& path : r.models) models.push_back(points_of(peer::read_model(path), kModelPoints));
  const cv::Mat scene = points_of(raw, kScenePoints);
  std::vector<peer::PeerPose> out;
  double ms = 0;
  for (std::size_t m = 0; m < models.size(); ++m) {
    ppf::PPF3DDetector detector(kModelStep, kModelStep);
    detector.trainModel(models[m]);  // once for a part: its time does not count
    // Its scene step is relative to the scene: so that both are sampled alike, as its paper wants.
    const double step = std::clamp(kSceneDistance * diameter(models[m]) / diameter(scene), 0.005, 0.05);
    const peer::Stopwatch watch;
    std::vector<ppf::Pose3DPtr> found;
    detector.match(scene, found, kSceneStep, step);
    if (found.size() > kRefined) found.resize(kRefined);
    if (!found.empty()) {
      ppf::ICP icp(100, 0.005f, 2.5f, 8);
      icp.registerModelToScene(models[m], scene, found);
    }
    const double size = diameter(models[m]);
    std::vector<peer::PeerPose> kept;
    for (const ppf::Pose3DPtr& pose : found) {
      if (pose->numVotes < kLeastVotesOfBest * found.front()->numVotes) continue;
      peer::PeerPose p{static_cast<int>(m), static_cast<double>(pose->numVotes), {}, {}};
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) p.rotation[3 * i + k] = pose->pose(i, k);
        p.translation_mm[i] = pose->pose(i, 3);
      }
      const bool again = std::any_of(kept.begin(), kept.end(), [&](const peer::PeerPose& other) {
        const double d =
            std::hypot(p.translation_mm[0] - other.translation_mm[0], p.translation_mm[1] - other.translation_mm[1],
                       p.translation_mm[2] - other.translation_mm[2]);
        return d < 0.3 * size;
      });
      if (!again) kept.push_back(p);
    }
    ms += watch.ms();
    out.insert(out.end(), kept.begin(), kept.end());
  }
  std::printf("{\"ms\": %.3f}\n", ms);
  peer::write_poses(r.out, out);
}
