#pragma once

// Bullet's headers come before all others: they define NULL-like macros of their own.
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <btBulletDynamicsCommon.h>

#include <vector>

#include "sim/solid.hpp"

namespace tribin::sim {

/// A shape for Bullet: a solid, or the floor and four walls without end around the inside of a bin. Centimetres.
class ShellShape final : public btCollisionShape {
 public:
  explicit ShellShape(const Solid::State& solid);
  ShellShape(double length_mm, double width_mm);

  const Solid::State* solid() const { return solid_; }  ///< null for the walls
  double length_mm() const { return length_mm_; }
  double width_mm() const { return width_mm_; }

  void getAabb(const btTransform& t, btVector3& low, btVector3& high) const override;
  void setLocalScaling(const btVector3&) override {}
  const btVector3& getLocalScaling() const override { return scaling_; }
  void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
  const char* getName() const override { return "shell"; }
  void setMargin(btScalar) override {}
  btScalar getMargin() const override { return 0; }

 private:
  const Solid::State* solid_ = nullptr;
  double length_mm_ = 0, width_mm_ = 0;
  btVector3 low_{0, 0, 0}, high_{0, 0, 0}, scaling_{1, 1, 1};
};

/// A place where two bodies come near each other. World frame, mm.
struct ShellContact {
  Vec3f on_a, on_b;
  Vec3f normal;        ///< from b to a
  float distance = 0;  ///< negative: overlap
  int point = 0;       ///< of the shell, to know the place again in the next step
  int side = 0;        ///< 0: a's shell in b's field, 1: the reverse, 2..6: a's shell at floor and walls
};

/// A contact of the step before.
struct KeptContact {
  int point, side;
  btManifoldPoint forces;  ///< of the solver
};

/// Meets of two shapes nearer than `reach`, at most 16 for two solids and 20 for a solid in a bin: the deepest, and
/// such as lie far from each other; those of the step before stay if they can, so that forces do not jump. `a` is a
/// solid.
std::vector<ShellContact> shell_contacts(const ShellShape& a, const Pose& world_from_a, const ShellShape& b,
                                         const Pose& world_from_b, float reach, const std::vector<KeptContact>& kept);

/// Bullet's way to ask for contacts of a pair; keeps the impulses of places that stay.
class ShellAlgorithm final : public btCollisionAlgorithm {
 public:
  struct Maker final : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper*,
                                                   const btCollisionObjectWrapper*) override;
  };
  explicit ShellAlgorithm(const btCollisionAlgorithmConstructionInfo& info) : btCollisionAlgorithm(info) {}
  ~ShellAlgorithm() override;

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult*) override;
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  static constexpr int kManifolds = 5;  ///< of four points
  btPersistentManifold* manifold_[kManifolds] = {};
};

/// The part's pose of a body's transform (principal axes, centimetres).
Pose pose_of(const btTransform& world_from_body, const Solid::State& solid);

}  // namespace tribin::sim
