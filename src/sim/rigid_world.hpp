#pragma once

#include <memory>
#include <optional>

#include "tribin/sim/bin_scene.hpp"

namespace tribin::sim {

/// Rigid bodies between the walls of a bin. Bullet stays behind this class.
class RigidWorld {
 public:
  /// Walls without end stand on the floor z = 0 at x = +-length / 2, y = +-width / 2.
  RigidWorld(double length_mm, double width_mm);
  ~RigidWorld();
  RigidWorld(const RigidWorld&) = delete;
  RigidWorld& operator=(const RigidWorld&) = delete;

  void add(const Solid& solid, const Pose& world_from_part, const Vec3& velocity_mm_s);
  void step();  ///< 1/240 s
  /// Share of its speed that a body loses in a second; 0 by default.
  void set_damping(double share);
  /// From now on the body stays as it lies; others rest on it.
  void freeze(int body);
  bool frozen(int body) const;
  /// A frozen body moves again.
  void thaw(int body);
  /// From now on the body goes where `move` puts it, and pushes others out of its way.
  void guide(int body);
  /// \param jump  it is simply there: nothing is pushed
  void move(int body, const Pose& world_from_part, bool jump = false);
  /// A guided body falls free, from rest.
  void let_go(int body);
  /// The body is gone; its number stays taken.
  void take_out(int body);
  bool there(int body) const;
  /// How deep two bodies lie in each other, at the points of their shells [mm]; below 0: that far apart at least, none
  /// beyond `reach`.
  std::optional<double> depth_mm(int a, int b, double reach) const;
  bool boxes_meet(int a, int b, double reach_mm) const;
  int size() const;
  Pose world_from_part(int body) const;
  double top_mm(int body) const;  ///< upper bound of its highest point

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::sim
