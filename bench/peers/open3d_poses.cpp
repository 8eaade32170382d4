// Open3D's FPFH features, RANSAC on their matches and point-to-plane ICP, part by part on what is left of the cloud:
// its usual recipe for one part, made a loop for a heap. It is given normals and a cloud without bin and table.

#include <open3d/Open3D.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "peer_io.hpp"

namespace {

using open3d::geometry::KDTreeSearchParamHybrid;
using open3d::geometry::PointCloud;
namespace registration = open3d::pipelines::registration;

// Settings of Open3D's own tutorial for global registration, in voxels; the voxel is 1/40 of the median part.
constexpr double kFeatureVoxels = 5, kMatchVoxels = 1.5;
// Both clouds are thinned: neighbours lie up to a voxel apart, where the tutorial refines whole clouds at 0.4.
constexpr double kIcpVoxels = 1;
// A part shows half of its surface at best, and the tutorial calls 0.3 of a whole overlap a fit: half of that and more.
constexpr double kLeastFitness = 0.2;
constexpr int kMostParts = 60, kMostFailures = 2;

PointCloud cloud_of(const std::vector<float>& values) {
  PointCloud cloud;
  for (std::size_t i = 0; i + 5 < values.size(); i += 6) {
    const float* p = values.data() + i;
    if (!std::isfinite(p[2]) || (p[3] == 0 && p[4] == 0 && p[5] == 0)) continue;
    cloud.points_.emplace_back(p[0], p[1], p[2]);
    cloud.normals_.emplace_back(p[3], p[4], p[5]);
  }
  return cloud;
}

struct Model {
  std::shared_ptr<PointCloud> cloud;
  std::shared_ptr<registration::Feature> feature;
};

std::shared_ptr<registration::Feature> features(const PointCloud& cloud, double voxel) {
  return registration::ComputeFPFHFeature(cloud, KDTreeSearchParamHybrid(kFeatureVoxels * voxel, 100));
}

registration::RegistrationResult registered(const Model& model, const PointCloud& scene,
                                            const registration::Feature& feature, double voxel) {
  const auto edges = registration::CorrespondenceCheckerBasedOnEdgeLength(0.9);
  const auto distance = registration::CorrespondenceCheckerBasedOnDistance(kMatchVoxels * voxel);
  const auto coarse = registration::RegistrationRANSACBasedOnFeatureMatching(
      *model.cloud, scene, *model.feature, feature, true, kMatchVoxels * voxel,
      registration::TransformationEstimationPointToPoint(false), 3, {edges, distance},
      registration::RANSACConvergenceCriteria(100000, 0.999));
  if (coarse.correspondence_set_.empty()) return coarse;
  return registration::RegistrationICP(*model.cloud, scene, kIcpVoxels * voxel, coarse.transformation_,
                                       registration::TransformationEstimationPointToPlane());
}

double diameter(const PointCloud& cloud) { return (cloud.GetMaxBound() - cloud.GetMinBound()).norm(); }

}  // namespace

int main(int argc, char** argv) {
  const peer::Request r = peer::read_request(argc, argv);
  const std::vector<float> raw = peer::read_floats(r.cloud, 6 * static_cast<std::size_t>(r.width) * r.height);
  std::vector<PointCloud> parts;
  std::vector<double> diameters;
  for (const std::string& path : r.models) {
    parts.push_back(cloud_of(peer::read_model(path)));
    diameters.push_back(diameter(parts.back()));
  }
  const PointCloud whole = cloud_of(raw);
  std::sort(diameters.begin(), diameters.end());
  const double voxel = diameters[diameters.size() / 2] / 40;
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  open3d::utility::random::Seed(1);

  std::vector<Model> models;  // made once for a part: its time does not count
  for (const PointCloud& part : parts) {
    Model model;
    model.cloud = part.VoxelDownSample(voxel);
    model.cloud->NormalizeNormals();
    model.feature = features(*model.cloud, voxel);
    models.push_back(model);
  }
  const peer::Stopwatch watch;
  std::shared_ptr<PointCloud> scene = whole.VoxelDownSample(voxel);
  scene->NormalizeNormals();
  std::vector<peer::PeerPose> out;
  for (int failures = 0; failures < kMostFailures && static_cast<int>(out.size()) < kMostParts;) {
    if (scene->points_.size() < 50) break;
    const auto feature = features(*scene, voxel);
    registration::RegistrationResult best;
    int which = -1;
    for (std::size_t m = 0; m < models.size(); ++m) {
      const auto result = registered(models[m], *scene, *feature, voxel);
      if (result.fitness_ > best.fitness_) best = result, which = static_cast<int>(m);
    }
    if (which < 0 || best.fitness_ < kLeastFitness) {
      ++failures;
      continue;
    }
    failures = 0;
    peer::PeerPose pose{which, best.fitness_, {}, {}};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) pose.rotation[3 * i + k] = best.transformation_(i, k);
      pose.translation_mm[i] = best.transformation_(i, 3);
    }
    out.push_back(pose);
    PointCloud placed = *models[static_cast<std::size_t>(which)].cloud;
    placed.Transform(best.transformation_);
    const std::vector<double> distances = scene->ComputePointCloudDistance(placed);
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < distances.size(); ++i)
      if (distances[i] > kMatchVoxels * voxel) left.push_back(i);
    if (left.size() == distances.size()) ++failures;  // explains nothing: it would come again
    scene = scene->SelectByIndex(left);
  }
  watch.report();
  peer::write_poses(r.out, out);
}
