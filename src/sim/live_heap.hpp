#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sim/rigid_world.hpp"

namespace tribin::sim {

/// How far any point of a part has moved, at most [mm].
double largest_motion(const Solid& solid, const Pose& from, const Pose& to);

/// A heap in which a gripper works: parts lie still until they are touched, or until what they lean on is gone. All
/// poses in the bin's frame.
class LiveHeap {
 public:
  /// A heap at rest. \param parts  must outlive it, as must the tools.
  LiveHeap(const Bin& bin, const std::vector<const Solid*>& parts, const std::vector<Pose>& bin_from_part);

  /// A piece of a gripper, far away. \return its number
  int add_tool(const Solid& piece);
  void move(int body, const Pose& bin_from_body);
  /// From now on the part goes where `move` puts it; what it touched may fall.
  void hold(int part);
  /// It falls.
  void let_go(int part);
  /// It stays where it is put, or is out of the bin.
  void stand(int part);

  /// 1/240 s. What a moved body touches wakes, and what has come to rest sleeps.
  void step();
  bool at_rest() const { return awake_ == 0; }
  const Pose& pose(int body) const { return pose_[body]; }
  const Solid& solid(int body) const { return *solids_[body]; }
  int parts() const { return parts_; }
  int bodies() const { return static_cast<int>(solids_.size()); }
  /// How deep two bodies lie in each other [mm]; none where they are farther apart than `reach`.
  std::optional<double> depth_mm(int a, int b, double reach) const { return world_.depth_mm(a, b, reach); }
  /// Deepest that a body lies in a wall or the floor [mm], 0 where it is clear. Walls end at the rim.
  double depth_in_walls_mm(int body) const;
  /// How far a part has moved since it last lay still, by no touch of a hand [mm].
  double moved_mm(int part) const;

 private:
  enum class State { still, awake, guided, standing };
  void wake(int part);
  void wake_neighbours(int body, double reach);

  Bin bin_;
  RigidWorld world_;
  int parts_ = 0, awake_ = 0, steps_ = 0;
  std::vector<const Solid*> solids_;
  std::vector<State> state_;
  std::vector<Pose> pose_, before_, rest_;  ///< now, at the last look, where it last lay still
};

}  // namespace tribin::sim
