#pragma once

#include <optional>
#include <span>
#include <vector>

#include "cell_mask.hpp"
#include "tribin/model/primitive_model.hpp"
#include "tribin/part/part.hpp"
#include "tribin/pose/scene_depth.hpp"
#include "tribin/recognition/instance.hpp"

// Hypotheses: poses of a part that some primitives of the scan suggest. They are many and cheap; the look-up in the
// depth image decides which are worth more work. Every generator writes into one list, in an order that depends on the
// input alone.
namespace tribin {

struct BinSighting;
class PointPairTable;

/// A scene primitive with what the generators need to know of it.
struct SceneFeature {
  const Primitive* primitive = nullptr;
  Vec3 centroid = Vec3::Zero();  ///< of its surfels, by area
  double reach_mm = 0;           ///< largest distance of a surfel from the centroid
  std::vector<Vec3f> ends;       ///< of a plane: surfels that are extreme in its directions, every 22.5 deg
};

/// The scene as the generators see it.
struct SceneFeatures {
  std::vector<SceneFeature> features;  ///< one a primitive of the observation, same order
  const Surfels* surfels = nullptr;
  const Primitives* primitives = nullptr;
  /// Of each cell the id of its primitive, 0 = none: cells that no primitive has go to the plane beside them in which
  /// they lie, as far as the noise of one pixel tells.
  Image<std::int32_t> label_of_cell;
  /// Planes, each in one piece or in many, that end nowhere before something farther away.
  struct Bottom {
    std::vector<int> primitives;  ///< ids
    double extent_mm = 0;         ///< largest distance between two of its points
  };
  std::vector<Bottom> bottoms;  ///< find_floors: longer than any face of the smallest part
  std::vector<bool> floor;      ///< find_floors: by id of primitive; empty = not looked for
  CellMask claimed;             ///< cells that an accepted instance explains
  /// Points that were explained since the same search was made last, thinned; none = it is made for the first time, and
  /// looks everywhere. Elsewhere it would end as it did.
  std::optional<std::vector<Vec3f>> fresh;

  /// May a search end otherwise here than it did last? \param reach_mm  how far what it looks at lies away.
  bool changed_near(const Vec3f& point, double reach_mm) const;
};

/// Local sd of z of one pixel at a cell [mm].
double local_sigma_mm(const Surfels& surfels, std::size_t cell);

/// Marks cells as explained and drops the features that lie in them.
void claim_cells(SceneFeatures& scene, const CellMask& mask);

/// Where the cells lie: all of a few, of many every fourth in both directions.
std::vector<Vec3f> points_of(const CellMask& mask, const Surfels& surfels);

SceneFeatures make_scene_features(const Primitives& primitives, const PrimitiveModel& observation,
                                  const Surfels& surfels);

/// A plane or cylinder of the CAD with what the generators need to know of it.
struct PartFeature {
  const Primitive* primitive = nullptr;
  double exposed_mm2 = 0;
  double reach_mm = 0;
};

/// The part's primitives that can be seen, best exposed first.
std::vector<PartFeature> visible_features(const Part& part, PrimitiveType type, std::size_t most);

/// Flags the cells of the scan that belong to the background of a part, what is too large to be a piece of it (a table,
/// a floor, a wall of the bin), or to an accepted instance.
Image<std::uint8_t> background_cells(const SceneFeatures& scene, const Part& part);

/// Finds floors: bottoms that are longer than any face of the parts. What is longer than any face of one of them is
/// background to it alone, for under a large part there may be others.
/// \param sigma_mm  the scan's noise.
void find_floors(SceneFeatures& scene, std::span<const Part> parts, double sigma_mm);
/// Flags the cells of floors: no part lies behind them.
Image<std::uint8_t> floor_cells(const SceneFeatures& scene);

/// The scene without the features that lie in the background: those that hypotheses start from.
SceneFeatures foreground(const SceneFeatures& scene, const Image<std::uint8_t>& background);

/// One cylinder: both senses of the axis, spins, slides. Leaves 2 of 6 directions to the enumeration.
void hypotheses_from_cylinders(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out);
/// One plane: spins and places of the seen piece on the CAD's face. Leaves 3 of 6 to the enumeration.
void hypotheses_from_planes(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out);
/// Two planes, two cylinders, or a plane and a cylinder whose angle, distance and radii agree: leaves at most a slide
/// or a spin.
void hypotheses_from_pairs(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out);
/// Pairs of oriented points of what nothing explains vote for where the part's own pairs lie alike: for parts and views
/// without handy primitives.
/// \source B. Drost, M. Ulrich, N. Navab, S. Ilic, "Model globally, match locally", CVPR 2010, on surfels.
/// \param background  of the part: background_cells.
void hypotheses_from_point_pairs(const SceneFeatures& scene, const Image<std::uint8_t>& background, const Part& part,
                                 const PointPairTable& table, std::vector<Pose>& out);

/// The surfels of connected pieces of the scan that neither the background nor an accepted instance explains and that
/// are large enough to be a piece of the part. Empty = nothing is left that could be one.
/// \param background  background_cells.
std::vector<std::uint32_t> unexplained_surfels(const SceneFeatures& scene, const Image<std::uint8_t>& background,
                                               const Part& part);

/// What neither a part nor the ground explains. The ground is the bin and what lies around it; without one, what is too
/// large for any of the parts. Pieces smaller than those that could be one of the parts are left out.
/// \param explained  cells of the parts that are told.
/// \param in_bin     cells_inside of the bin; not read without one.
/// \return largest volume first.
std::vector<UnexplainedRegion> unexplained_regions(const SceneFeatures& scene, std::span<const Part> parts,
                                                   const CellMask& explained, const BinSighting* bin,
                                                   const Image<std::uint8_t>& in_bin);

/// Rotation that turns frame (x, y) of the part onto that of the camera: camera_from_part with R x_part = x_camera and
/// the y of both in one half plane.
Matrix3 rotation_from_directions(const Vec3& x_part, const Vec3& y_part, const Vec3& x_camera, const Vec3& y_camera);

/// The pose with this rotation that brings a part's point onto a camera's point.
Pose pose_from(const Matrix3& rotation, const Vec3& part_point, const Vec3& camera_point);

}  // namespace tribin
