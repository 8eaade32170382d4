#include "sim/rigid_world.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/shell_contacts.hpp"

namespace tribin::sim {
namespace {

constexpr float kStep = 1.0f / 240;
// Bullet is made for lengths near 1: it gets centimetres.
constexpr double kUnit = 0.1;
// No part falls faster than after a fall of its own diameter, nor than 5 mm a step: none is shot through another.
constexpr float kTopSpeed = 120;  // cm/s
constexpr float kTopSpin = 12;    // rad/s
constexpr int kIterations = 30;   // of the solver: heaps of some layers

btTransform to_bullet(const Pose& pose) {
  btTransform t;
  const Matrix3 r = pose.linear();
  t.setBasis(btMatrix3x3(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)));
  const Vec3 p = pose.translation() * kUnit;
  t.setOrigin(btVector3(p.x(), p.y(), p.z()));
  return t;
}

void limit_speed(btDynamicsWorld* world, btScalar) {
  for (int i = 0; i < world->getNumCollisionObjects(); ++i) {
    btRigidBody* body = btRigidBody::upcast(world->getCollisionObjectArray()[i]);
    if (!body || body->isStaticObject()) continue;
    const float speed = body->getLinearVelocity().length(), spin = body->getAngularVelocity().length();
    const auto* shape = static_cast<const ShellShape*>(body->getCollisionShape());
    const float top = std::min(kTopSpeed, std::sqrt(2 * 981 * static_cast<float>(shape->solid()->diameter * kUnit)));
    if (speed > top) body->setLinearVelocity(body->getLinearVelocity() * (top / speed));
    if (spin > kTopSpin) body->setAngularVelocity(body->getAngularVelocity() * (kTopSpin / spin));
  }
}

btDefaultCollisionConstructionInfo pool_sizes() {
  btDefaultCollisionConstructionInfo info;
  info.m_customCollisionAlgorithmMaxElementSize = static_cast<int>(sizeof(ShellAlgorithm));
  return info;
}

}  // namespace

struct RigidWorld::State {
  btDefaultCollisionConfiguration configuration{pool_sizes()};
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  ShellAlgorithm::Maker maker;
  ShellShape walls;
  std::unique_ptr<btRigidBody> bin;
  struct Body {
    const Solid* solid;
    std::unique_ptr<ShellShape> shape;
    std::unique_ptr<btDefaultMotionState> motion;
    std::unique_ptr<btRigidBody> body;
  };
  std::vector<Body> bodies;

  State(double length_mm, double width_mm) : walls(length_mm, width_mm) {}
};

RigidWorld::RigidWorld(double length_mm, double width_mm) : state_(std::make_unique<State>(length_mm, width_mm)) {
  State& s = *state_;
  s.dispatcher.registerCollisionCreateFunc(CUSTOM_CONCAVE_SHAPE_TYPE, CUSTOM_CONCAVE_SHAPE_TYPE, &s.maker);
  s.world.setGravity(btVector3(0, 0, -981));
  s.world.getDispatchInfo().m_deterministicOverlappingPairs = true;
  s.world.setInternalTickCallback(limit_speed);
  btContactSolverInfo& solver = s.world.getSolverInfo();
  solver.m_numIterations = kIterations;
  solver.m_splitImpulse = true;  // mending overlap gives no speed
  solver.m_splitImpulsePenetrationThreshold = 0;
  solver.m_erp2 = 0.3f;
  // Dry friction in two fixed directions, which start at the force of the step before: leaning parts do not creep.
  solver.m_solverMode = SOLVER_SIMD | SOLVER_USE_WARMSTARTING | SOLVER_USE_2_FRICTION_DIRECTIONS |
                        SOLVER_ENABLE_FRICTION_DIRECTION_CACHING | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
  s.bin = std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &s.walls));
  s.world.addRigidBody(s.bin.get());
}

RigidWorld::~RigidWorld() {
  for (State::Body& b : state_->bodies) state_->world.removeRigidBody(b.body.get());
  state_->world.removeRigidBody(state_->bin.get());
}

void RigidWorld::add(const Solid& solid, const Pose& world_from_part, const Vec3& velocity_mm_s) {
  const Solid::State& s = solid.state();
  State::Body b{&solid, std::make_unique<ShellShape>(s), nullptr, nullptr};
  b.motion = std::make_unique<btDefaultMotionState>(to_bullet(world_from_part * s.part_from_body));
  // The mass is 1 for a part of median size and goes with the hull, so that impulses are of one order.
  const float mass = static_cast<float>(s.hull_volume * kUnit * kUnit * kUnit / 1000);
  const Vec3 inertia = s.inertia_per_mass * (kUnit * kUnit * mass);
  btRigidBody::btRigidBodyConstructionInfo info(mass, b.motion.get(), b.shape.get(),
                                                btVector3(inertia.x(), inertia.y(), inertia.z()));
  b.body = std::make_unique<btRigidBody>(info);
  const Vec3 v = velocity_mm_s * kUnit;
  b.body->setLinearVelocity(btVector3(v.x(), v.y(), v.z()));
  // Below 4 mm/s and 3 deg/s for half a second a body sleeps until it is touched.
  b.body->setSleepingThresholds(0.4f, 0.05f);
  b.body->setDeactivationTime(0);
  state_->world.addRigidBody(b.body.get());
  state_->bodies.push_back(std::move(b));
}

void RigidWorld::step() { state_->world.stepSimulation(kStep, 0, kStep); }

void RigidWorld::set_damping(double share) {
  for (State::Body& b : state_->bodies) b.body->setDamping(static_cast<float>(share), static_cast<float>(share));
}

void RigidWorld::freeze(int body) {
  btRigidBody& b = *state_->bodies[body].body;
  state_->world.removeRigidBody(&b);  // it comes back among the static ones, which do not meet each other
  b.setLinearVelocity(btVector3(0, 0, 0));
  b.setAngularVelocity(btVector3(0, 0, 0));
  b.setMassProps(0, btVector3(0, 0, 0));
  state_->world.addRigidBody(&b);
}

bool RigidWorld::frozen(int body) const { return state_->bodies[body].body->isStaticObject(); }

int RigidWorld::size() const { return static_cast<int>(state_->bodies.size()); }

Pose RigidWorld::world_from_part(int body) const {
  const State::Body& b = state_->bodies[body];
  return pose_of(b.body->getWorldTransform(), b.solid->state());
}

double RigidWorld::top_mm(int body) const {
  btVector3 low, high;
  state_->bodies[body].body->getAabb(low, high);
  return high.z() / kUnit;
}

}  // namespace tribin::sim
