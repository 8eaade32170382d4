#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// Difficulty of simulated scenes, fixed for good: number of parts, noise, systematic error, tilt, lost pixels.
enum class Level { easy, dense, hard };

/// \throws Error bad_option for anything but easy, dense, hard.
Level level_of(const std::string& name);

struct TableDatasetOptions {
  std::vector<Mesh> parts;  ///< with their names; object k + 1 of the data set is parts[k]
  Level level = Level::easy;
  int scenes = 1;                                      ///< >= 1
  std::uint64_t seed = 1;                              ///< scene i depends on seed and i alone
  std::function<void(int done, int scenes)> progress;  ///< called after each scene, if set
};

/// Parts side by side on a table, each in one of its stable rests, scanned, with their truth, as a BOP data set in
/// `directory` (made if absent). Parts that find no room are left out. Mirror bounces between parts are not modelled.
/// \throws Error bad_option (no part, scenes < 1, two equal names), too_little_data (a part without volume),
///               bad_input (the directory cannot be written).
void simulate_table_dataset(const TableDatasetOptions& options, const std::filesystem::path& directory);

}  // namespace tribin::sim
