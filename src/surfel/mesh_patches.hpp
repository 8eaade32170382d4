#pragma once

#include <cstdint>
#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin::surfel_detail {

/// Two triangles that share an edge.
struct MeshEdge {
  std::uint32_t a, b;    ///< triangles
  std::uint32_t v0, v1;  ///< vertices
  float dihedral;        ///< [rad] between the normals; 0 = coplanar; > 0 convex, < 0 concave
  float length;          ///< mm
};

/// Coplanar patches of a mesh and what lies across their rims.
struct MeshPatches {
  std::vector<Vec3> normal;              ///< per triangle
  std::vector<double> area;              ///< per triangle [mm^2]
  std::vector<MeshEdge> edges;           ///< manifold edges only
  std::vector<std::uint32_t> patch;      ///< per triangle
  std::vector<double> patch_area;        ///< per patch
  std::vector<double> patch_width;       ///< per patch: area over longest extent, what a strip is narrow in
  std::vector<double> patch_rim;         ///< per patch: length of its rim
  std::vector<double> patch_smooth_rim;  ///< of it, where the surface goes on with less than kSmooth
};

/// The sharpest dihedral angle that a tessellated curved surface may have: coarse files turn a circle in 10 facets.
/// Below the 45 deg of a chamfer, which is an edge.
inline constexpr double kSmooth = 40.0 * kDegree;

MeshPatches find_patches(const Mesh& mesh);

}  // namespace tribin::surfel_detail
