#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"

// One primitive, and what it leaves free enumerated.
namespace tribin {
namespace {

// 15 deg between spins: the look-up tolerates half of that at the rim of a part (3.5 % of the diameter).
constexpr int kSpins = 24;

/// Radii that can be one: 5 sigma of the measured one and 2 % for castings and facets, as the free radius is only a
/// check.
bool radius_agrees(const Primitive& seen, const Primitive& nominal) {
  const double sigma = std::sqrt(std::max(0.0, seen.covariance(4, 4)));
  const double limit = std::min(5 * sigma, 0.25 * nominal.radius_mm) + 0.02 * nominal.radius_mm;
  return seen.concave == nominal.concave && std::abs(seen.radius_mm - nominal.radius_mm) <= limit;
}

bool spins_freely(const Part& part, const Primitive& p) {
  for (const ContinuousSymmetry& s : part.symmetry.continuous) {
    const Eigen::Vector3d axis = s.axis;
    const Eigen::Vector3d off = Eigen::Vector3d(p.point) - Eigen::Vector3d(s.point);
    if (std::abs(axis.dot(Eigen::Vector3d(p.axis))) > 0.9999 && off.cross(axis).norm() < 0.01 * part.diameter_mm)
      return true;
  }
  return false;
}

/// Where the seen piece [0, seen] can lie on the nominal run [0, nominal]: the shifts of its middle, ends first.
std::vector<double> slides(double seen, double nominal, double step) {
  const double play = 0.5 * (nominal - seen);
  if (play <= step) return {0.0};
  std::vector<double> out = {0.0, -play, play};
  for (double s = step; s < play - 0.5 * step; s += step) {
    out.push_back(s);
    out.push_back(-s);
  }
  return out;
}

}  // namespace

void hypotheses_from_cylinders(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out) {
  const std::vector<PartFeature> nominal = visible_features(part, PrimitiveType::cylinder, 12);
  const double step = 0.05 * part.diameter_mm;
  for (const SceneFeature& f : scene.features) {
    const Primitive& seen = *f.primitive;
    if (seen.type != PrimitiveType::cylinder) continue;
    const Vec3 seen_middle = seen.point + seen.axis * (0.5 * (seen.extent_min + seen.extent_max));
    for (const PartFeature& n : nominal) {
      const Primitive& c = *n.primitive;
      if (!radius_agrees(seen, c) || seen.height_mm() > 1.3 * c.height_mm() + step) continue;
      const Vec3 middle = c.point + c.axis * (0.5 * (c.extent_min + c.extent_max));
      Vec3 pu, pv, su, sv;
      orthonormal_basis(c.axis, pu, pv);
      orthonormal_basis(seen.axis, su, sv);
      const int spins = spins_freely(part, c) ? 1 : kSpins;
      for (const double sign : {1.0, -1.0})
        for (const double slide : slides(seen.height_mm(), c.height_mm(), step))
          for (int k = 0; k < spins; ++k) {
            const double a = 2 * kPi * k / spins;
            const Vec3 side = su * std::cos(a) + sv * std::sin(a);
            const Matrix3 r = rotation_from_directions(c.axis, pu, seen.axis * sign, side);
            out.push_back(pose_from(r, middle, seen_middle + seen.axis * slide));
          }
    }
  }
}

void hypotheses_from_planes(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out) {
  const std::vector<PartFeature> nominal = visible_features(part, PrimitiveType::plane, 8);
  for (const SceneFeature& f : scene.features) {
    const Primitive& seen = *f.primitive;
    if (seen.type != PrimitiveType::plane) continue;
    for (const PartFeature& n : nominal) {
      const Primitive& face = *n.primitive;
      if (seen.area_mm2 > 1.3 * face.area_mm2 || seen.area_mm2 < 0.05 * face.area_mm2) continue;
      // A piece with a share of the face's area can lie off the face's centre by what is missing of the face's reach.
      const double play = n.reach_mm * (1 - std::sqrt(std::min(1.0, seen.area_mm2 / face.area_mm2)));
      const double step = std::max(0.07 * part.diameter_mm, 1e-6);
      const int rings = std::min(3, static_cast<int>(std::ceil(play / step - 0.5)));
      Vec3 pu, pv, su, sv;
      orthonormal_basis(face.axis, pu, pv);
      orthonormal_basis(seen.axis, su, sv);
      for (int k = 0; k < kSpins; ++k) {
        const double a = 2 * kPi * k / kSpins;
        const Matrix3 r = rotation_from_directions(face.axis, pu, seen.axis, su * std::cos(a) + sv * std::sin(a));
        for (int i = -rings; i <= rings; ++i)
          for (int j = -rings; j <= rings; ++j) {
            if (i * i + j * j > rings * rings) continue;
            out.push_back(pose_from(r, face.point, f.centroid + su * (i * step) + sv * (j * step)));
          }
      }
    }
  }
}

}  // namespace tribin
