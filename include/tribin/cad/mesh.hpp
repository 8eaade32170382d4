#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin {

enum class SurfaceType : std::uint8_t { plane, cylinder, cone, sphere, torus, free_form };

/// An exact surface of a B-rep face (STEP, IGES). Unused fields are 0.
struct CadFace {
  int id = 0;  ///< from 1, the order in the file
  SurfaceType type = SurfaceType::free_form;
  Vec3 axis = Vec3::Zero();    ///< unit; plane: outward normal
  Vec3 point = Vec3::Zero();   ///< plane: a point on it; cylinder, torus: on the axis; cone: apex; sphere: centre
  double radius_mm = 0;        ///< cylinder, sphere, torus (major)
  double minor_radius_mm = 0;  ///< torus
  double half_angle = 0;       ///< cone [rad]
  bool concave = false;        ///< the material lies outside of the radius (a hole)
  double area_mm2 = 0;         ///< of the trimmed face
};

/// The boundary of a part as triangles, in the part's own frame, mm; outward orientation where `oriented`.
struct Mesh {
  std::vector<Vec3f> vertices;                          ///< welded: equal points are one vertex
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
  std::vector<std::int32_t> face_of_triangle;           ///< CadFace id, or empty when the file has no faces
  std::vector<CadFace> faces;                           ///< exact surfaces (STEP, IGES); empty for meshes
  double chord_error_mm = 0;                            ///< of the tessellation, where known
  bool oriented = true;                                 ///< false: two-sided use
  std::string name;                                     ///< file's stem
  std::vector<std::string> warnings;                    ///< what was mended or odd
};

}  // namespace tribin
