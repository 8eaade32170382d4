#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/image.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

/// What the curvature of a surfel proves, against its own sigma. `unknown` may join a plane or a cylinder later.
enum class SurfelShape : std::uint8_t { unknown, flat, ruled, curved };

/// Small pieces of surface: the ONE input of segmentation, whether they come from a scan, loose points or a CAD file.
/// Structure of arrays; entry i of each vector belongs to surfel i.
struct Surfels {
  std::vector<Vec3f> position;    ///< mm; camera frame (scan), file frame (points), part frame (CAD)
  std::vector<Vec3f> normal;      ///< unit; towards the camera (scan), outward (CAD): on the whole sphere
  std::vector<float> curvature1;  ///< [1/mm] principal, |curvature1| >= |curvature2|; > 0 convex (ball from outside)
  std::vector<float> curvature2;  ///< [1/mm]
  std::vector<Vec3f> direction2;  ///< unit; direction of curvature2: the ruling of a cylinder or cone
  std::vector<float> sigma_curvature;  ///< [1/mm] sd of curvature1
  std::vector<float> sigma_normal;     ///< [rad] sd per tangent axis
  std::vector<float> sigma_mm;         ///< sd of the position along the normal
  std::vector<float> area_mm2;         ///< on the surface: the weight in all votes
  std::vector<SurfelShape> shape;
  std::vector<std::uint32_t> points;  ///< number of raw points (scan, points) or 1 (CAD)

  std::vector<std::uint32_t> neighbour_begin;  ///< CSR: neighbours of i are neighbours[neighbour_begin[i] .. [i+1])
  std::vector<std::uint32_t> neighbours;       ///< 8 of the cell grid, mesh edges, or nearest points

  // Where the surfels came from; exactly one of these. Surfels never outlive their source.
  const Scan* scan = nullptr;
  const PointSet* point_set = nullptr;
  const Mesh* mesh = nullptr;

  /// Normals have one side on the whole of the surface: towards the camera or outward. Without a viewpoint loose points
  /// have one side on each smooth patch only.
  bool oriented = true;
  std::vector<std::uint32_t> surfel_of_point;  ///< points: per raw point; duplicates and crowds share a surfel

  int cell_px = 0;                     ///< scan: side of a cell [px]
  Image<std::int32_t> surfel_of_cell;  ///< scan: grid of cells, -1 = none
  std::vector<std::uint32_t> cell;     ///< scan: row-major index of the surfel's cell
  Image<float> local_sigma_mm;         ///< scan: the estimated local noise of z, one value per tile of 8 x 8 cells
  double correlation_px = 0;           ///< scan: used noise correlation
  float max_radius_mm = 100;           ///< the radius that `flat` was proven against

  std::size_t size() const { return position.size(); }
};

struct SurfelOptions {
  int cell_px = 0;            ///< [px] 2..16; 0 = 4, or more where the noise hides the curvature of max_radius_mm
  float max_radius_mm = 100;  ///< largest radius that must be told from a plane; sets what "flat" must prove
};

/// Cuts a scan into cells and fits each a plane in inverse depth, then a quadric over windows of cells.
/// \throws Error too_little_data when fewer than 100 pixels are valid.
Surfels surfels_from_scan(const Scan& scan, const SurfelOptions& options = {});

/// One surfel per point, from the smallest neighbourhood whose normal and curvature the noise lets decide. Clouds of
/// more than 200,000 points are thinned to means first. Without a viewpoint normals point outward as far as neighbours
/// tell.
/// \param options  max_radius_mm counts only as far as the cloud's diagonal.
/// \throws Error   too_little_data for fewer than 30 points.
/// \cost           20,000 points 0.2 s, 1,000,000 points 4 s (2 cores).
Surfels surfels_from_points(const PointSet& points, const SurfelOptions& options = {});

/// The surfels of loose points again, fitted to some of them only: neighbourhoods no longer reach into what is
/// explained. Entry k belongs to members[k]; the noise is that of `all`.
Surfels surfels_among(const Surfels& all, std::span<const std::uint32_t> members);

/// One surfel per triangle; curvature from the dihedral angles of smooth neighbours.
Surfels surfels_from_mesh(const Mesh& mesh);

/// Estimates the noise of z and its correlation from the scan itself.
NoiseProfile estimate_noise(const Scan& scan);

}  // namespace tribin
