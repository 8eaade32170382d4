#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// One image of a data set: a scan with its truth.
struct BopImage {
  const SimulatedScan* simulated = nullptr;
  Pose camera_from_world = Pose::Identity();
  std::vector<int> object_of_body;  ///< BOP obj_id (from 1) of each body; 0 = no part (table)
};

/// Starts a data set: models/ (PLY, models_info.json with diameter and box) and camera.json.
void write_bop_models(const std::filesystem::path& dataset, const std::vector<Mesh>& parts, const PinholeCamera& camera,
                      double depth_scale);

/// Writes test/SCENE/ with image 0: depth, mask_visib, scene_camera.json, scene_gt.json, scene_gt_info.json and
/// scene_parts.json (the classes to look for: all that the data set has).
/// \throws Error out_of_range when a depth does not fit in 16 bit at this depth_scale.
void write_bop_scene(const std::filesystem::path& dataset, int scene, const BopImage& image, int classes,
                     double depth_scale);

/// The finest of 0.02, 0.05, 0.1 mm a step that holds the scan's largest depth in 16 bit. Steps of 0.02 mm add an sd of
/// 0.006 mm: nothing beside noise of 0.05 mm.
double depth_scale_for(double largest_mm);

}  // namespace tribin::sim
