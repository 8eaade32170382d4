#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tribin/part/part.hpp"

namespace tribin::eval {

// The layout of a BOP data set: what lies where, and what is to be looked for in which image.

/// A part of the data set.
struct BopObject {
  int id = 0;                  ///< obj_id
  std::string name;            ///< `name` of models_info.json, else obj_%06d
  std::filesystem::path file;  ///< its mesh [mm]
  SymmetryGroup symmetry;      ///< as models_info.json states it
};

/// The parts of `models_dir` (obj_%06d.ply), by id.
/// \throws Error bad_input when there is none, or when two have one name.
std::vector<BopObject> list_bop_objects(const std::filesystem::path& models_dir);

/// An image in which parts are looked for.
struct BopTask {
  int scene = 0;
  int image = 0;
  std::vector<int> objects;      ///< ids of the parts that are offered, ascending
  std::filesystem::path depth;   ///< depth image
  std::filesystem::path camera;  ///< scene_camera.json
};

/// What is to be done in a split, by scene and image.
/// \param targets  a file as BOP's test_targets_bop19.json: its images, and in each the parts that it names. Empty: all
///                 images of the split, each with the parts of scene_parts.json beside its scene_camera.json, or with
///                 all parts of the data set.
/// \throws Error   bad_input (no such split, a target without image or part), naming the file and the place in it.
std::vector<BopTask> list_bop_tasks(const std::filesystem::path& dataset, const std::string& split,
                                    const std::filesystem::path& targets, const std::vector<BopObject>& objects);

/// Which of `shards` an image belongs to: by a hash of both numbers, so that each shard gets like shares of all scenes.
int shard_of(int scene, int image, int shards);

}  // namespace tribin::eval
