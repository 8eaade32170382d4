#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/sim/paper_experiment.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// One image of a data set: a scan with its truth.
struct BopImage {
  const SimulatedScan* simulated = nullptr;
  Pose camera_from_world = Pose::Identity();
  std::vector<int> object_of_body;  ///< BOP obj_id (from 1) of each body; 0 = no part (table)
  std::vector<PoseBound> bounds;    ///< of each body, or empty
  double scale_error = 0;  ///< sd of the relative depth error of the whole scene, as the camera's maker states it
  double shape_error = 0;  ///< rms of the one that changes smoothly over the image
};

/// Starts a data set: models/ (PLY, models_info.json with diameter, box and symmetries; `near_symmetries_discrete` are
/// the self-similar poses, largest overlap first) and camera.json.
void write_bop_models(const std::filesystem::path& dataset, const std::vector<Mesh>& parts, const PinholeCamera& camera,
                      double depth_scale);

/// Writes a scene's folder, with image 0: depth, mask_visib, scene_camera.json, scene_gt.json, scene_gt_info.json (with
/// `bound_mm` and `bound_deg`, the Cramer-Rao bound of the very pixels, where there is one) and scene_parts.json (the
/// classes to look for: all that the data set has); and truth/ with images of 16 bit, 0 where no part is: depth.png (as
/// the measured one, without noise), label.png (place in scene_gt.json + 1), normal.png (RGB, n = value / 32767.5 - 1,
/// camera frame, towards the camera), face.png (CAD face id; of meshes without faces the triangle's number from 1, 0
/// beyond 65,535). \throws Error out_of_range when a depth does not fit in 16 bit at this depth_scale.
void write_bop_scene(const std::filesystem::path& folder, const BopImage& image, int classes, double depth_scale);

/// The finest of 0.02, 0.05, 0.1 mm a step that holds the scan's largest depth in 16 bit. Steps of 0.02 mm add an sd of
/// 0.006 mm: nothing beside noise of 0.05 mm.
double depth_scale_for(double largest_mm);

}  // namespace tribin::sim
