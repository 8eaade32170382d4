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
    if (!body || body->isStaticOrKinematicObject()) continue;
    const float speed = body->getLinearVelocity().length(), spin = body->getAngularVelocity().length();
    const auto* shape = static_cast<const ShellShape*>(body->getCollisionShape());
    const float top = std::min(kTopSpeed, std::sqrt(2 * 981 * static_cast<float>(shape->solid()->diameter * kUnit)));
    if (speed > top) body->setLinearVelocity(body->getLinearVelocity() * (top / speed));
    if (spin > kTopSpin) body->setAngularVelocity(body->getAngularVelocity() * (kTopSpin / spin));
  }
}

/// The mass is 1 for a part of median size and goes with the hull, so that impulses are of one order.
std::pair<float, btVector3> mass_of(const Solid::State& s) {
  const float mass = static_cast<float>(s.hull_volume * kUnit * kUnit * kUnit / 1000);
  const Vec3 inertia = s.inertia_per_mass * (kUnit * kUnit * mass);
  return {mass, btVector3(inertia.x(), inertia.y(), inertia.z())};
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
    bool there = true;
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
  for (State::Body& b : state_->bodies)
    if (b.there) state_->world.removeRigidBody(b.body.get());
  state_->world.removeRigidBody(state_->bin.get());
}

void RigidWorld::add(const Solid& solid, const Pose& world_from_part, const Vec3& velocity_mm_s) {
  const Solid::State& s = solid.state();
  State::Body b{&solid, std::make_unique<ShellShape>(s), nullptr, nullptr, true};
  b.motion = std::make_unique<btDefaultMotionState>(to_bullet(world_from_part * s.part_from_body));
  const auto [mass, inertia] = mass_of(s);
  btRigidBody::btRigidBodyConstructionInfo info(mass, b.motion.get(), b.shape.get(), inertia);
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
  b.setCollisionFlags(b.getCollisionFlags() & ~btCollisionObject::CF_KINEMATIC_OBJECT);
  b.setLinearVelocity(btVector3(0, 0, 0));
  b.setAngularVelocity(btVector3(0, 0, 0));
  b.setMassProps(0, btVector3(0, 0, 0));
  state_->world.addRigidBody(&b);
}

bool RigidWorld::frozen(int body) const { return state_->bodies[body].body->isStaticObject(); }

void RigidWorld::thaw(int body) {
  State::Body& entry = state_->bodies[body];
  btRigidBody& b = *entry.body;
  state_->world.removeRigidBody(&b);
  b.setCollisionFlags(b.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT &
                      ~btCollisionObject::CF_KINEMATIC_OBJECT);
  const auto [mass, inertia] = mass_of(entry.solid->state());
  b.setMassProps(mass, inertia);
  b.updateInertiaTensor();
  b.setLinearVelocity(btVector3(0, 0, 0));
  b.setAngularVelocity(btVector3(0, 0, 0));
  b.clearForces();
  b.setInterpolationWorldTransform(b.getWorldTransform());
  b.setInterpolationLinearVelocity(btVector3(0, 0, 0));
  b.setInterpolationAngularVelocity(btVector3(0, 0, 0));
  state_->world.addRigidBody(&b);
  b.forceActivationState(ACTIVE_TAG);
  b.setDeactivationTime(0);
}

void RigidWorld::guide(int body) {
  freeze(body);
  btRigidBody& b = *state_->bodies[body].body;
  state_->world.removeRigidBody(&b);
  b.setCollisionFlags((b.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT) |
                      btCollisionObject::CF_KINEMATIC_OBJECT);
  b.getMotionState()->setWorldTransform(b.getWorldTransform());
  state_->world.addRigidBody(&b);
  b.forceActivationState(DISABLE_DEACTIVATION);
}

void RigidWorld::move(int body, const Pose& world_from_part, bool jump) {
  State::Body& b = state_->bodies[body];
  const btTransform t = to_bullet(world_from_part * b.solid->state().part_from_body);
  b.body->getMotionState()->setWorldTransform(t);
  b.body->setWorldTransform(t);
  if (jump) b.body->setInterpolationWorldTransform(t);  // its speed is reckoned from there
}

void RigidWorld::let_go(int body) { thaw(body); }

void RigidWorld::take_out(int body) {
  State::Body& b = state_->bodies[body];
  if (b.there) state_->world.removeRigidBody(b.body.get());
  b.there = false;
}

bool RigidWorld::there(int body) const { return state_->bodies[body].there; }

bool RigidWorld::boxes_meet(int a, int b, double reach_mm) const {
  btVector3 low_a, high_a, low_b, high_b;
  state_->bodies[a].body->getAabb(low_a, high_a);
  state_->bodies[b].body->getAabb(low_b, high_b);
  const float reach = static_cast<float>(reach_mm * kUnit);
  for (int k = 0; k < 3; ++k)
    if (low_a[k] > high_b[k] + reach || low_b[k] > high_a[k] + reach) return false;
  return true;
}

std::optional<double> RigidWorld::depth_mm(int a, int b, double reach) const {
  if (!boxes_meet(a, b, reach)) return {};
  const std::vector<ShellContact> contacts =
      shell_contacts(*state_->bodies[a].shape, world_from_part(a), *state_->bodies[b].shape, world_from_part(b),
                     static_cast<float>(reach), {});
  std::optional<double> deepest;
  for (const ShellContact& c : contacts)
    deepest = std::max(deepest.value_or(-1e30), static_cast<double>(-(c.on_a - c.on_b).dot(c.normal)));
  return deepest;
}

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
