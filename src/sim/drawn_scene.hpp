#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "sim/random.hpp"
#include "tribin/sim/bin_scene.hpp"
#include "tribin/sim/dataset.hpp"
#include "tribin/sim/stable_rests.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// What stands before the camera, drawn by a seed, and how it is measured.
struct DrawnScene {
  std::vector<Body> bodies;
  std::vector<int> object_of_body;  ///< BOP obj_id (from 1); 0 = no part
  Pose camera_from_world = Pose::Identity();
  StructuredLight sensor;
  double largest_depth_mm = 0;  ///< that it was laid out for
  nlohmann::ordered_json info;  ///< what is special to the kind
  std::vector<Mesh> own;        ///< meshes that the bodies point to: reserved before, never grown after
};

/// A bin and who looks at it.
struct BinView {
  Bin bin;
  Pose camera_from_bin = Pose::Identity();
  double distance_mm = 0;  ///< to the bin's floor, along the optical axis
  double farthest_mm = 0;  ///< upper bound of depths
  double table_side_mm =
      4000;  ///< less in cells: a camera that looks aslant would see an endless table up to the horizon
};

/// How a cell's camera sees its bin, and how it measures there. \param top_mm  of the heap
/// \throws Error out_of_range where it does not see the middle of the floor
BinView view_of_cell(const CellView& cell, double top_mm, const LevelSettings& level, Random& random,
                     StructuredLight& sensor);

/// Table and bin before the camera, the bodies that a scene of a bin begins with. \param meshes  two, which must stay
std::vector<Body> table_and_bin(const BinView& view, const std::vector<Mesh>& meshes);
/// The meshes for `table_and_bin`.
std::vector<Mesh> bin_and_table_meshes(const BinView& view);

/// What is made once for all scenes of a data set. Points into the parts, which must stay.
struct SceneStock {
  const std::vector<Mesh>* parts = nullptr;
  std::vector<double> diameters_mm;            ///< of the parts
  std::vector<std::vector<StableRest>> rests;  ///< tables
  std::vector<Mesh> foreign_meshes;            ///< bins of levels with foreign objects
  std::vector<Solid> solids, foreign;          ///< bins
  Mesh table;
};
SceneStock make_stock(const std::vector<Mesh>& parts, SceneKind kind, const LevelSettings& level);

DrawnScene draw_table_scene(const SceneStock& stock, const LevelSettings& level, std::uint64_t seed);
/// \param kind  bin, empty or foreign.
/// \param cell  bin and camera of a work cell; without, they are drawn: a bin that the parts fill, seen wholly. A heap
///              that would lean over the cell's rim gets fewer parts.
/// \throws Error out_of_range where the cell's camera does not see its bin, or no part fits into it.
DrawnScene draw_bin_scene(const SceneStock& stock, SceneKind kind, const LevelSettings& level, std::uint64_t seed,
                          const std::optional<CellView>& cell = {});

}  // namespace tribin::sim
