#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"

// Two primitives whose pose-invariant keys (types, angle, distance, radii) agree between scan and CAD.
namespace tribin {
namespace {

// Axes of scan primitives of the size of a part are good to a degree or two when they are good at all.
constexpr double kAngleTolerance = 3 * kDegree;

bool radius_near(const Primitive& seen, const Primitive& nominal) {
  const double sigma = std::sqrt(std::max(0.0, seen.covariance(4, 4)));
  return seen.concave == nominal.concave && std::abs(seen.radius_mm - nominal.radius_mm) <
                                                0.04 * nominal.radius_mm + std::min(5 * sigma, 0.2 * nominal.radius_mm);
}

Eigen::Vector3d middle_of(const Primitive& p) { return Vec3(p.point + p.axis * (0.5 * (p.extent_min + p.extent_max))); }

/// Two faces: rotation fixed, places of both along their normals fixed, a slide along the edge direction left.
void plane_plane(const SceneFeatures& scene, const Part& part, const std::vector<PartFeature>& faces,
                 std::vector<Pose>& out) {
  const double step = 0.05 * part.diameter_mm;
  for (std::size_t i = 0; i < scene.features.size(); ++i)
    for (std::size_t j = i + 1; j < scene.features.size(); ++j) {
      const SceneFeature &fa = scene.features[i], &fb = scene.features[j];
      const Primitive &a = *fa.primitive, &b = *fb.primitive;
      if (a.type != PrimitiveType::plane || b.type != PrimitiveType::plane) continue;
      if ((fa.centroid - fb.centroid).norm() > part.diameter_mm) continue;
      const double angle = std::acos(std::clamp(a.axis.dot(b.axis), -1.0, 1.0));
      if (angle < 20 * kDegree || angle > 160 * kDegree) continue;  // nearly parallel faces fix no spin
      for (const PartFeature& na : faces)
        for (const PartFeature& nb : faces) {
          if (na.primitive == nb.primitive) continue;
          const Primitive &p = *na.primitive, &q = *nb.primitive;
          if (std::abs(std::acos(std::clamp(p.axis.dot(q.axis), -1.0, 1.0)) - angle) > kAngleTolerance) continue;
          if (a.area_mm2 > 1.3 * p.area_mm2 || b.area_mm2 > 1.3 * q.area_mm2) continue;
          // Do they bend the same way? The neighbour's centroid lies below (convex) or above (concave) the first face.
          const double seen_side = a.axis.dot(fb.centroid - fa.centroid), cad_side = p.axis.dot(q.point - p.point);
          if (seen_side * cad_side < 0 && std::min(std::abs(seen_side), std::abs(cad_side)) > 0.05 * part.diameter_mm)
            continue;
          const Matrix3 r = rotation_from_directions(p.axis, q.axis, a.axis, b.axis);
          // Translation: on both planes, and the centroids' slide along the common edge.
          const Eigen::Vector3d edge = Eigen::Vector3d(a.axis).cross(Eigen::Vector3d(b.axis)).normalized();
          Eigen::Matrix3d m;
          m << Eigen::Vector3d(a.axis).transpose(), Eigen::Vector3d(b.axis).transpose(), edge.transpose();
          const Eigen::Vector3d rp = r * p.point, rq = r * q.point;
          for (int s = -2; s <= 2; ++s) {
            Eigen::Vector3d rhs;
            rhs << a.axis.dot(fa.centroid) - a.axis.dot(Vec3(rp)), b.axis.dot(fb.centroid) - b.axis.dot(Vec3(rq)),
                0.5 * (edge.dot(Eigen::Vector3d(fa.centroid) - rp) + edge.dot(Eigen::Vector3d(fb.centroid) - rq)) +
                    s * step;
            Pose pose = Pose::Identity();
            pose.linear() = r;
            pose.translation() = m.inverse() * rhs;
            out.push_back(pose);
          }
        }
    }
}

/// Two cylinders: skew or crossing axes fix all, parallel ones leave a slide, coaxial ones nothing that one did not
/// give.
void cylinder_cylinder(const SceneFeatures& scene, const Part& part, const std::vector<PartFeature>& cylinders,
                       std::vector<Pose>& out) {
  const double step = 0.05 * part.diameter_mm;
  for (std::size_t i = 0; i < scene.features.size(); ++i)
    for (std::size_t j = 0; j < scene.features.size(); ++j) {
      if (i == j) continue;
      const SceneFeature &fa = scene.features[i], &fb = scene.features[j];
      const Primitive &a = *fa.primitive, &b = *fb.primitive;
      if (a.type != PrimitiveType::cylinder || b.type != PrimitiveType::cylinder) continue;
      if ((fa.centroid - fb.centroid).norm() > part.diameter_mm) continue;
      const Eigen::Vector3d ma = middle_of(a), mb = middle_of(b);
      for (const PartFeature& na : cylinders) {
        const Primitive& p = *na.primitive;
        if (!radius_near(a, p)) continue;
        for (const PartFeature& nb : cylinders) {
          const Primitive& q = *nb.primitive;
          if (&p == &q || !radius_near(b, q)) continue;
          const double seen_cos = std::abs(a.axis.dot(b.axis)), cad_cos = std::abs(p.axis.dot(q.axis));
          if (std::abs(std::acos(std::min(1.0, seen_cos)) - std::acos(std::min(1.0, cad_cos))) > kAngleTolerance)
            continue;
          const Eigen::Vector3d mp = middle_of(p), mq = middle_of(q);
          const auto across = [](const Eigen::Vector3d& axis, const Eigen::Vector3d& d) -> Eigen::Vector3d {
            return d - axis * axis.dot(d);
          };
          const Eigen::Vector3d seen_off = across(a.axis, mb - ma), cad_off = across(p.axis, mq - mp);
          const bool parallel = cad_cos > std::cos(10 * kDegree);
          if (parallel) {
            // The paper's v1 and v3: the axis, and the offset across it.
            if (cad_off.norm() < 0.05 * part.diameter_mm ||
                std::abs(seen_off.norm() - cad_off.norm()) > 0.03 * part.diameter_mm)
              continue;
            for (const double sign : {1.0, -1.0}) {
              const Matrix3 r = rotation_from_directions(p.axis, Vec3(cad_off), a.axis * sign, Vec3(seen_off));
              for (int s = -4; s <= 4; ++s)
                out.push_back(pose_from(r, Vec3(mp), Vec3(ma + Eigen::Vector3d(a.axis) * (s * step))));
            }
          } else {
            for (const double sa : {1.0, -1.0})
              for (const double sb : {1.0, -1.0}) {
                const Matrix3 r = rotation_from_directions(p.axis, q.axis, a.axis * sa, b.axis * sb);
                // Along a by the closest point of axis b; across by axis a itself.
                const auto foot = [](const Eigen::Vector3d& o1, const Eigen::Vector3d& d1, const Eigen::Vector3d& o2,
                                     const Eigen::Vector3d& d2) -> Eigen::Vector3d {
                  const double c = d1.dot(d2);
                  const Eigen::Vector3d w = o2 - o1;
                  return o1 + d1 * ((w.dot(d1) - c * w.dot(d2)) / (1 - c * c));
                };
                out.push_back(pose_from(r, Vec3(foot(mp, p.axis, mq, q.axis)), Vec3(foot(ma, a.axis, mb, b.axis))));
              }
          }
        }
      }
    }
}

/// A cylinder with a face across its axis leaves the spin; with a face along its axis the slide.
void cylinder_plane(const SceneFeatures& scene, const Part& part, const std::vector<PartFeature>& cylinders,
                    const std::vector<PartFeature>& faces, std::vector<Pose>& out) {
  constexpr int kSpins = 24;
  const double step = 0.05 * part.diameter_mm;
  for (const SceneFeature& fc : scene.features) {
    const Primitive& a = *fc.primitive;
    if (a.type != PrimitiveType::cylinder) continue;
    const Eigen::Vector3d axis = a.axis, ma = middle_of(a);
    for (const SceneFeature& fp : scene.features) {
      const Primitive& b = *fp.primitive;
      if (b.type != PrimitiveType::plane) continue;
      if ((fc.centroid - fp.centroid).norm() > part.diameter_mm) continue;
      const double cosine = axis.dot(Eigen::Vector3d(b.axis));
      const bool across = std::abs(cosine) > std::cos(2 * kAngleTolerance);
      const bool along = std::abs(cosine) < std::sin(kAngleTolerance);
      if (!across && !along) continue;
      for (const PartFeature& nc : cylinders) {
        const Primitive& p = *nc.primitive;
        if (!radius_near(a, p)) continue;
        const Eigen::Vector3d p_axis = p.axis, mp = middle_of(p);
        for (const PartFeature& nf : faces) {
          const Primitive& q = *nf.primitive;
          const double cad_cosine = p_axis.dot(Eigen::Vector3d(q.axis));
          if (b.area_mm2 > 1.3 * q.area_mm2) continue;
          if (across && std::abs(cad_cosine) > std::cos(kAngleTolerance)) {
            const double sign = cad_cosine * cosine > 0 ? 1.0 : -1.0;
            Vec3 pu, pv, su, sv;
            orthonormal_basis(p.axis, pu, pv);
            orthonormal_basis(a.axis, su, sv);
            // Both axes, cut with both faces: the paper's intersection point of a plane and a cylinder's axis.
            const auto cut = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d, const Primitive& face,
                                const Vec3& on) {
              const Eigen::Vector3d n = face.axis;
              return Vec3(o + d * (n.dot(Eigen::Vector3d(on) - o) / n.dot(d)));
            };
            const Vec3 part_point = cut(mp, p_axis, q, q.point), scene_point = cut(ma, axis, b, fp.centroid);
            for (int k = 0; k < kSpins; ++k) {
              const double angle = 2 * kPi * k / kSpins;
              const Matrix3 r =
                  rotation_from_directions(p.axis, pu, a.axis * sign, su * std::cos(angle) + sv * std::sin(angle));
              out.push_back(pose_from(r, part_point, scene_point));
            }
          } else if (along && std::abs(cad_cosine) < std::sin(kAngleTolerance)) {
            // The distance of the axis from the face is the key.
            const double cad_distance = Eigen::Vector3d(q.axis).dot(mp - Eigen::Vector3d(q.point));
            const double seen_distance = Eigen::Vector3d(b.axis).dot(ma - Eigen::Vector3d(fp.centroid));
            if (std::abs(cad_distance - seen_distance) > 0.03 * part.diameter_mm) continue;
            for (const double sign : {1.0, -1.0}) {
              const Matrix3 r = rotation_from_directions(p.axis, q.axis, a.axis * sign, b.axis);
              for (int s = -4; s <= 4; ++s) out.push_back(pose_from(r, Vec3(mp), Vec3(ma + axis * (s * step))));
            }
          }
        }
      }
    }
  }
}

}  // namespace

void hypotheses_from_pairs(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out) {
  const std::vector<PartFeature> faces = visible_features(part, PrimitiveType::plane, 10);
  const std::vector<PartFeature> cylinders = visible_features(part, PrimitiveType::cylinder, 10);
  cylinder_cylinder(scene, part, cylinders, out);
  cylinder_plane(scene, part, cylinders, faces, out);
  plane_plane(scene, part, faces, out);
}

}  // namespace tribin
