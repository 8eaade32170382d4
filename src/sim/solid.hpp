#pragma once

#include "sim/distance_field.hpp"
#include "sim/mesh_distance.hpp"
#include "sim/point_shell.hpp"
#include "tribin/sim/bin_scene.hpp"

namespace tribin::sim {

struct Solid::State {
  explicit State(const Mesh& m) : mesh(&m), exact(m), field(m), shell(make_point_shell(m)) {}
  const Mesh* mesh;
  MeshDistance exact;
  DistanceField field;
  PointShell shell;
  Pose part_from_body = Pose::Identity();  ///< body frame: centre of mass, principal axes
  Vec3 inertia_per_mass = Vec3::Zero();    ///< about the principal axes [mm^2]
  double hull_volume = 0, diameter = 0;
};

}  // namespace tribin::sim
