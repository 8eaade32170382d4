#pragma once

#include <nlohmann/json.hpp>
#include <vector>

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
  double largest_depth_mm = 0;  ///< upper bound
  nlohmann::ordered_json info;  ///< what is special to the kind
  std::vector<Mesh> own;        ///< meshes that the bodies point to: reserved before, never grown after
};

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
