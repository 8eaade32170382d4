#pragma once

#include <cstdint>
#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin {

/// A place on the surface, and how far the facets there may lie from the surface that they stand for.
struct SurfaceSample {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  double slack_mm = 0;  ///< two tessellations of the same curved surface may be this far apart here
  double bend = 0;      ///< [rad] largest angle to a neighbouring facet of the same smooth surface
};

struct SurfaceHit {
  int triangle = -1;  ///< -1 = none within reach
  Vec3 point = Vec3::Zero();
  double distance_mm = 0;
};

/// Nearest-surface queries that only see facets which face about the same way, so that the two sides of a thin plate
/// and the two faces at an edge are never mistaken for each other.
class SurfaceIndex {
 public:
  /// \throws Error too_little_data for a mesh without area.
  explicit SurfaceIndex(const Mesh& mesh);

  /// Is there surface within `radius_mm` of p, its normal within acos(min_cos) of n?
  bool has_near(const Vec3& p, const Vec3& n, double radius_mm, double min_cos) const;
  /// The nearest such surface point.
  SurfaceHit nearest(const Vec3& p, const Vec3& n, double radius_mm, double min_cos) const;
  const Vec3& normal(int triangle) const { return triangles_[triangle].normal; }

  /// `count` places, uniform by area; each prefix of the list is uniform too (R3 low-discrepancy sequence).
  std::vector<SurfaceSample> sample(int count) const;

  double area_mm2() const { return area_mm2_; }
  double diameter_mm() const { return diameter_mm_; }        ///< largest distance of two corners (by sweeps)
  const Vec3& centroid() const { return centroid_; }         ///< of the surface, by area
  const Matrix3& covariance() const { return covariance_; }  ///< of the surface about its centroid [mm^2]

 private:
  struct Triangle {
    Vec3 a, ab, ac, normal;
    double area = 0, slack_mm = 0, bend = 0;
  };
  struct Node {
    float low[3], high[3];
    float normal_low[3], normal_high[3];  ///< of the facets below: a whole branch may face the wrong way
    std::int32_t first = 0,
                 count = 0;  ///< leaf: triangles first .. first + count; inner (count 0): children first, first + 1
  };
  template <class Visit>
  void visit_within(const Vec3& p, const Vec3& n, double radius_mm, double min_cos, Visit&& visit) const;
  void measure_facets(const Mesh& mesh, const std::vector<int>& kept);
  void build_nodes();

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
  bool oriented_ = true;
  double area_mm2_ = 0;
  double diameter_mm_ = 0;
  Vec3 centroid_ = Vec3::Zero();
  Matrix3 covariance_ = Matrix3::Zero();
};

}  // namespace tribin
