#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/scan/scan.hpp"
#include "tribin/sim/bin_scene.hpp"
#include "tribin/sim/levels.hpp"

namespace tribin::sim {

enum class SceneKind {
  table,   ///< parts side by side, each in one of its stable rests
  bin,     ///< a heap that physics made
  empty,   ///< a bin as for such a heap, with nothing in it
  foreign  ///< a bin with objects that are no parts, and no part
};

/// \throws Error bad_option for anything but table, bin, empty and foreign.
SceneKind scene_kind_of(const std::string& name);

/// A work cell's bin before a work cell's camera, where drawn ones would stand.
struct CellView {
  PinholeCamera camera;  ///< with its size
  NoiseProfile noise;    ///< what is known of it holds, in place of the level's
  Pose camera_from_bin = Pose::Identity();
  Bin bin;
};

struct DatasetOptions {
  std::vector<Mesh> parts;  ///< with their names; object k + 1 of the data set is parts[k]
  SceneKind kind = SceneKind::table;
  Level level = Level::easy;
  int scenes = 1;                         ///< >= 1
  std::uint64_t seed = 1;                 ///< scene i depends on parts, kind, level, seed and i alone
  std::optional<CellView> cell = {};      ///< scenes of this cell; not for tables
  std::optional<double> systematic = {};  ///< largest relative error of depth over the image, in place of the level's
  double scale_error = 0;                 ///< sd of a relative depth error that a whole scene has in common
  bool frames = false;  ///< also frames/: the pictures of a Gray code set with frames.json and rig.json, for `scan`
  std::function<void(int done, int scenes)> progress;  ///< called after each scene, by one thread at a time, if set
};

/// Scenes with their truth, as a BOP data set in `directory` (made if absent). A scene's folder appears when it is
/// whole; scenes that are there are kept, so that a run that was broken off, or is asked for more scenes, goes on. One
/// scene a core. On tables, parts that find no room are left out. \throws Error bad_option (no part, scenes < 1, two
/// equal names, the folder holds another data set),
///               too_little_data (a part without volume), bad_input (the directory cannot be written).
void simulate_dataset(const DatasetOptions& options, const std::filesystem::path& directory);

/// Where scenes are written until they are whole: below the data set's folder. What lies there can be removed.
std::filesystem::path unfinished_scenes(const std::filesystem::path& directory);

}  // namespace tribin::sim
