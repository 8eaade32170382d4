#include "tribin/paper_method/recognize.hpp"

#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"
#include "tribin/paper_method/pose.hpp"
#include "tribin/paper_method/tests.hpp"
#include "tribin/recognition/unexplained.hpp"

namespace tribin::paper {
namespace {

constexpr std::size_t kTried = 2000;  ///< posed pairs looked at with a few points: what a second allows
constexpr std::size_t kSettled = 6;   ///< of those, brought to rest by ICP on many points
constexpr std::size_t kFewPoints = 80, kManyPoints = 600;
constexpr int kFewSteps = 3, kManySteps = 60;

std::vector<Vec3f> sampled(const Object& object, const Surfels& surfels, std::size_t most) {
  std::vector<Vec3f> out;
  const std::size_t count = std::min(most, object.surfels.size());
  for (std::size_t k = 0; k < count; ++k)
    out.push_back(surfels.position[object.surfels[k * object.surfels.size() / count]]);
  return out;
}

struct Settled {
  const Part* part = nullptr;
  PosedPair posed;
  Icp icp;
};

const PartView& seen_view(const Part& part, const Matrix3& rotation, const Vec3& translation) {
  return nearest_view(part, -(rotation.transpose() * translation + part.box_center()).normalized());
}

Vec3 centroid(std::span<const Vec3f> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3f& p : points) sum += p.cast<double>();
  return points.empty() ? sum : Vec3(sum / static_cast<double>(points.size()));
}

/// "An initial position can be found by estimating the centroid of all 3D points from the observations" (IV-C): it is
/// laid on the centroid of what a camera sees of the model from there.
void place_by_centroid(PosedPair& posed, const Part& part, const Vec3& seen) {
  posed.translation = seen - posed.rotation * part.box_center();
  posed.translation = seen - posed.rotation * centroid(seen_view(part, posed.rotation, posed.translation).points);
}

std::vector<Settled> settled(const Object& object, const Surfels& surfels, const Part& part,
                             std::vector<PosedPair> posed) {
  std::stable_sort(posed.begin(), posed.end(),
                   [](const PosedPair& a, const PosedPair& b) { return a.agreement > b.agreement; });
  if (posed.size() > kTried) posed.resize(kTried);
  std::vector<Settled> out;
  const auto settle = [&](const PosedPair& p, std::span<const Vec3f> points, std::size_t of_model, int steps) {
    const std::vector<Vec3f>& view = seen_view(part, p.rotation, p.translation).points;
    return icp_translation(points, std::span(view).first(std::min(of_model, view.size())), p.rotation, p.translation,
                           steps);
  };
  const std::vector<Vec3f> few = sampled(object, surfels, kFewPoints), many = sampled(object, surfels, kManyPoints);
  const Vec3 middle = centroid(many);
  for (PosedPair& p : posed)
    if (!p.base) place_by_centroid(p, part, middle);
  for (const PosedPair& p : posed) out.push_back({&part, p, settle(p, few, 2 * kFewPoints, kFewSteps)});
  const auto nearer = [](const Settled& a, const Settled& b) {
    return a.icp.mean_distance_mm < b.icp.mean_distance_mm;
  };
  std::stable_sort(out.begin(), out.end(), nearer);
  if (out.size() > kSettled) out.resize(kSettled);
  for (Settled& s : out) s.icp = settle(s.posed, many, many.size(), kManySteps);
  std::stable_sort(out.begin(), out.end(), nearer);
  return out;
}

/// Which step a test belongs to, in the order in which candidates meet them.
const char* stage_of(const std::string& test) {
  static const std::pair<const char*, const char*> kStages[] = {
      {"cylinder_radius", "matching"},        {"cylinder_height", "matching"},   {"superquadric", "matching"},
      {"largest_cylinder", "key_cylinders"},  {"sub_cylinder", "key_cylinders"}, {"cylinder_angle", "key_cylinders"},
      {"cylinder_distance", "key_cylinders"}, {"icp_distance", "pose"}};
  for (const auto& [name, stage] : kStages)
    if (test == name) return stage;
  return "key_planes";
}

Evidence evidence_of(const Match& match) {
  Evidence e;
  e.type = match.model->type;
  e.primitive = std::string(name_of(e.type)) + " " + std::to_string(match.model->id);
  e.cad_primitive = match.model->id;
  e.scan_primitive = match.seen->id;
  e.visible_arc = match.seen->arc;
  e.inliers = match.seen->points;
  e.rms_mm = match.seen->rms_mm;
  if (e.type == PrimitiveType::cylinder) {
    e.radius_nominal_mm = match.model->radius_mm;
    if (!match.seen->radius_from_cad) {
      e.radius_measured_mm = match.seen->radius_mm;
      e.radius_sigma_mm = std::sqrt(match.seen->covariance(4, 4));
    }
  }
  e.tests = match.tests;
  return e;
}

double visible_fraction(const Object& object, const Surfels& surfels, const PartView& view) {
  double seen = 0;
  for (std::uint32_t i : object.surfels)
    seen += surfels.area_mm2[i] * std::abs(surfels.normal[i].dot(surfels.position[i].normalized()));
  return view.area_mm2 > 0 ? std::min(1.0, seen / view.area_mm2) : 0;
}

Instance instance_of(const Settled& best, const Object& object, const Surfels& surfels) {
  const Part& part = *best.part;
  Instance out;
  out.part = part.name;
  out.camera_from_part.linear() = best.posed.rotation;
  out.camera_from_part.translation() = best.icp.translation;
  out.visible_fraction = visible_fraction(object, surfels, seen_view(part, best.posed.rotation, best.icp.translation));
  const TestResult distance = icp_distance(best.icp.mean_distance_mm, part.diameter_mm);
  out.score = 1 - 0.5 * distance.value / distance.limit;  // ranks by equation (8); it is no probability
  // The paper has no covariance: the misfit along each axis, and the turn by which it moves the rim.
  const double share = distance.value * distance.value / 3;
  out.covariance.topLeftCorner<3, 3>() = share * Eigen::Matrix3d::Identity();
  out.covariance.bottomRightCorner<3, 3>() =
      share / (part.gyration_mm * part.gyration_mm) * Eigen::Matrix3d::Identity();
  for (std::size_t k = 1; k < part.symmetry.discrete.size(); ++k)
    out.equivalent_poses.push_back(out.camera_from_part * part.symmetry.discrete[k]);
  out.evidence = {evidence_of(best.posed.key->main), evidence_of(best.posed.key->sub)};
  std::vector<TestResult>& of_pair = out.evidence[1].tests;
  of_pair.insert(of_pair.end(), best.posed.tests.begin(), best.posed.tests.end());
  if (best.posed.base) out.evidence.push_back(evidence_of(*best.posed.base));
  if (best.posed.second) out.evidence.push_back(evidence_of(*best.posed.second));
  out.evidence.front().tests.push_back(distance);
  return out;
}

}  // namespace

Instances recognize(const Primitives& primitives, const PrimitiveModel& observation, const Surfels& surfels,
                    std::span<const Part> parts) {
  Instances out;
  if (parts.empty()) return out;
  double largest = 0, smallest = 1e300;
  for (const Part& part : parts) {
    largest = std::max(largest, part.diameter_mm);
    smallest = std::min(smallest, part.diameter_mm);
  }
  for (const Object& object : objects_in(primitives, observation, surfels, largest, smallest)) {
    if (object.cylinders.empty() && object.planes.empty()) continue;  // crumbs
    std::vector<std::vector<KeyPair>> keys(parts.size());             // kept alive: the evidence points into them
    std::vector<Settled> all;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Part& part = parts[k];
      const Check check = [&](const TestResult& test) {
        if (!test.passed) add_reason(out.rejected, {part.name, stage_of(test.test), test.test, test.value, test.limit});
        return test.passed;
      };
      keys[k] = key_pairs(object, part, surfels, check);
      std::vector<PosedPair> posed;
      for (const KeyPair& key : keys[k])
        for (PosedPair& p : posed_pairs(key, object, surfels, part, check)) posed.push_back(std::move(p));
      for (Settled& s : settled(object, surfels, part, std::move(posed)))
        if (check(icp_distance(s.icp.mean_distance_mm, part.diameter_mm))) all.push_back(std::move(s));
    }
    const auto best = std::min_element(all.begin(), all.end(), [](const Settled& a, const Settled& b) {
      return a.icp.mean_distance_mm / a.part->diameter_mm < b.icp.mean_distance_mm / b.part->diameter_mm;
    });
    if (best != all.end())
      out.items.push_back(instance_of(*best, object, surfels));
    else
      out.unexplained.push_back(region_of(surfels, object.surfels, ground_around(surfels, primitives, object.surfels)));
  }
  std::stable_sort(out.items.begin(), out.items.end(),
                   [](const Instance& a, const Instance& b) { return a.score > b.score; });
  for (std::size_t i = 0; i < out.items.size(); ++i) out.items[i].id = static_cast<int>(i) + 1;
  return out;
}

}  // namespace tribin::paper
