#include "sim/shell_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

namespace tribin::sim {
namespace {

constexpr float kUnit = 0.1f;  // centimetres
// Contacts are seen this far beyond what two bodies approach in a step, and at most at the second [mm].
constexpr float kReachAtRest = 0.3f, kReach = 6;
constexpr float kStep = 1.0f / 240;
// Parts rest this far apart: what the rounding of edges by the distance field may hide.
constexpr float kGap = 0.3f;
constexpr float kFriction = 0.4f;  // dry metal on metal, metal on plastic
// Lever of rolling friction, of the smaller diameter: rounds of cast and machined parts are no ideal cylinders.
constexpr float kRolling = 0.005f;
constexpr std::size_t kPerSide = 8;   // contacts kept of each direction
constexpr std::size_t kPerPlane = 4;  // and of each wall: a flat side stands on three
constexpr int kDepthOfTree = 64;

using Motion = Eigen::Transform<float, 3, Eigen::Isometry, Eigen::DontAlign>;

/// The deepest contact, then such as are far from those taken; near ones and those of the step before first.
void keep_spread(std::vector<ShellContact>& found, std::size_t wanted, const std::vector<KeptContact>& before) {
  if (found.size() <= wanted) return;
  constexpr float kKnown = 9;  // a place that was a contact counts as three times as far from the others
  std::vector<float> weight(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const float near = 1 + std::max(0.0f, found[i].distance) / kGap;
    const bool known = std::any_of(before.begin(), before.end(), [&](const KeptContact& k) {
      return k.point == found[i].point && k.side == found[i].side;
    });
    weight[i] = (known ? kKnown : 1.0f) / (near * near);
  }
  std::size_t first = 0;
  for (std::size_t i = 1; i < found.size(); ++i)
    if (found[i].distance < found[first].distance) first = i;
  std::vector<float> gap(found.size(), 1e30f);
  std::vector<ShellContact> kept;
  std::size_t next = first;
  while (kept.size() < wanted) {
    kept.push_back(found[next]);
    std::size_t best = 0;
    float score = -1;
    for (std::size_t i = 0; i < found.size(); ++i) {
      gap[i] = std::min(gap[i], (found[i].on_a - kept.back().on_a).squaredNorm());
      const float s = gap[i] * weight[i];
      if (s > score) score = s, best = i;
    }
    if (score <= 0) break;
    next = best;
  }
  found = std::move(kept);
}

/// Points of one shell near the other's surface.
void shell_in_field(const Solid::State& shell, const Motion& field_from_shell, const Solid::State& other,
                    const Motion& world_from_field, int side, float reach, std::vector<ShellContact>& out) {
  std::array<std::int32_t, kDepthOfTree> stack{};
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const PointShell::Node& node = shell.shell.nodes[stack[--depth]];
    if (other.field.lower_bound(field_from_shell * node.centre) > node.radius + reach) continue;
    if (node.child >= 0) {
      stack[depth++] = node.child + 1;
      stack[depth++] = node.child;
      continue;
    }
    for (std::int32_t i = node.first; i < node.last; ++i) {
      const Vec3f p = field_from_shell * shell.shell.points[i];
      Vec3f out_of_field;
      const float d = other.field.at(p);
      if (d > reach) continue;
      other.field.at(p, out_of_field);
      const Vec3f here = world_from_field * p, there = world_from_field * Vec3f(p - d * out_of_field);
      const Vec3f normal = world_from_field.linear() * out_of_field;
      if (side == 0)
        out.push_back({here, there, normal, d - kGap, i, side});
      else
        out.push_back({there, here, -normal, d - kGap, i, side});
    }
  }
}

/// Points of a shell near one plane, n . x = offset with the free side at n . x > offset.
void shell_at_plane(const Solid::State& solid, const Motion& world_from_part, const Vec3f& n, float offset, int side,
                    float reach, std::vector<ShellContact>& out) {
  std::array<std::int32_t, kDepthOfTree> stack{};
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const PointShell::Node& node = solid.shell.nodes[stack[--depth]];
    if (n.dot(world_from_part * node.centre) - offset > node.radius + reach) continue;
    if (node.child >= 0) {
      stack[depth++] = node.child + 1;
      stack[depth++] = node.child;
      continue;
    }
    for (std::int32_t i = node.first; i < node.last; ++i) {
      const Vec3f p = world_from_part * solid.shell.points[i];
      const float d = n.dot(p) - offset;
      if (d <= reach) out.push_back({p, p - d * n, n, d - kGap, i, side});
    }
  }
}

/// Of any point of a body [cm/s].
float top_speed(const btCollisionObjectWrapper& wrapper, const ShellShape& shape) {
  if (!shape.solid()) return 0;
  const btVector3 v = wrapper.getCollisionObject()->getInterpolationLinearVelocity(),
                  w = wrapper.getCollisionObject()->getInterpolationAngularVelocity();
  return v.length() + w.length() * static_cast<float>(shape.solid()->diameter) * kUnit / 2;
}

btVector3 to_bullet(const Vec3f& p) { return {p.x() * kUnit, p.y() * kUnit, p.z() * kUnit}; }

}  // namespace

ShellShape::ShellShape(const Solid::State& solid) : solid_(&solid) {
  m_shapeType = CUSTOM_CONCAVE_SHAPE_TYPE;
  const Pose body_from_part = solid.part_from_body.inverse();
  Vec3 low = Vec3::Constant(1e30), high = -low;
  for (const Vec3f& v : solid.mesh->vertices) {
    const Vec3 p = body_from_part * Vec3(v.cast<double>());
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  low.array() -= kReach, high.array() += kReach;
  low_ = to_bullet(low.cast<float>()), high_ = to_bullet(high.cast<float>());
}

ShellShape::ShellShape(double length_mm, double width_mm) : length_mm_(length_mm), width_mm_(width_mm) {
  m_shapeType = CUSTOM_CONCAVE_SHAPE_TYPE;
  low_ = btVector3(-1e4f, -1e4f, -1e4f), high_ = -low_;
}

void ShellShape::getAabb(const btTransform& t, btVector3& low, btVector3& high) const {
  btTransformAabb(low_, high_, 0, t, low, high);
}

Pose pose_of(const btTransform& t, const Solid::State& solid) {
  const btQuaternion q = t.getRotation();
  Pose world_from_body = Pose::Identity();
  world_from_body.linear() = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
  world_from_body.translation() =
      Vec3(t.getOrigin().x(), t.getOrigin().y(), t.getOrigin().z()) / static_cast<double>(kUnit);
  return world_from_body * solid.part_from_body.inverse();
}

std::vector<ShellContact> shell_contacts(const ShellShape& a, const Pose& world_from_a, const ShellShape& b,
                                         const Pose& world_from_b, float reach, const std::vector<KeptContact>& kept) {
  const Motion world_a(world_from_a.cast<float>());
  std::vector<ShellContact> all, found;
  if (!b.solid()) {
    const float x = static_cast<float>(b.length_mm() / 2), y = static_cast<float>(b.width_mm() / 2);
    const std::array<Vec3f, 5> normals = {Vec3f(0, 0, 1), Vec3f(1, 0, 0), Vec3f(-1, 0, 0), Vec3f(0, 1, 0),
                                          Vec3f(0, -1, 0)};
    const std::array<float, 5> offsets = {0, -x, -x, -y, -y};
    for (int k = 0; k < 5; ++k) {
      found.clear();
      shell_at_plane(*a.solid(), world_a, normals[k], offsets[k], 2 + k, reach, found);
      keep_spread(found, kPerPlane, kept);
      all.insert(all.end(), found.begin(), found.end());
    }
    return all;
  }
  const Motion world_b(world_from_b.cast<float>());
  const Pose b_from_a = world_from_b.inverse() * world_from_a;
  shell_in_field(*a.solid(), Motion(b_from_a.cast<float>()), *b.solid(), world_b, 0, reach, all);
  keep_spread(all, kPerSide, kept);
  shell_in_field(*b.solid(), Motion(b_from_a.inverse().cast<float>()), *a.solid(), world_a, 1, reach, found);
  keep_spread(found, kPerSide, kept);
  all.insert(all.end(), found.begin(), found.end());
  return all;
}

btCollisionAlgorithm* ShellAlgorithm::Maker::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                                      const btCollisionObjectWrapper*,
                                                                      const btCollisionObjectWrapper*) {
  return new (info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(ShellAlgorithm))) ShellAlgorithm(info);
}

ShellAlgorithm::~ShellAlgorithm() {
  for (btPersistentManifold* manifold : manifold_)
    if (manifold) m_dispatcher->releaseManifold(manifold);
}

void ShellAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (btPersistentManifold* manifold : manifold_)
    if (manifold) manifolds.push_back(manifold);
}

void ShellAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                      const btDispatcherInfo&, btManifoldResult*) {
  const auto* shape_a = static_cast<const ShellShape*>(first->getCollisionShape());
  const auto* shape_b = static_cast<const ShellShape*>(second->getCollisionShape());
  if (!shape_a->solid()) {
    std::swap(shape_a, shape_b);
    std::swap(first, second);
  }
  const Pose world_a = pose_of(first->getWorldTransform(), *shape_a->solid());
  const Pose world_b = shape_b->solid() ? pose_of(second->getWorldTransform(), *shape_b->solid()) : Pose::Identity();
  std::vector<KeptContact> kept;
  for (btPersistentManifold* manifold : manifold_) {
    if (!manifold) continue;
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      const btManifoldPoint& p = manifold->getContactPoint(i);
      kept.push_back({p.m_index0, p.m_partId0, p});
    }
    manifold->clearManifold();
  }
  const float approach = top_speed(*first, *shape_a) + top_speed(*second, *shape_b);
  const float reach = std::min(kReach, kGap + kReachAtRest + approach * kStep / kUnit);
  const std::vector<ShellContact> contacts = shell_contacts(*shape_a, world_a, *shape_b, world_b, reach, kept);
  const btTransform a_from_world = first->getWorldTransform().inverse(),
                    b_from_world = second->getWorldTransform().inverse();
  const double smaller =
      shape_b->solid() ? std::min(shape_a->solid()->diameter, shape_b->solid()->diameter) : shape_a->solid()->diameter;
  const float rolling = kRolling * static_cast<float>(smaller) * kUnit;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    btPersistentManifold*& manifold = manifold_[i / MANIFOLD_CACHE_SIZE];
    if (!manifold) manifold = m_dispatcher->getNewManifold(first->getCollisionObject(), second->getCollisionObject());
    const ShellContact& c = contacts[i];
    const btVector3 on_a = to_bullet(c.on_a), on_b = to_bullet(c.on_b);
    btManifoldPoint point(a_from_world * on_a, b_from_world * on_b, to_bullet(c.normal) / kUnit, c.distance * kUnit);
    point.m_positionWorldOnA = on_a;
    point.m_positionWorldOnB = on_b;
    point.m_index0 = c.point;
    point.m_partId0 = c.side;
    point.m_combinedFriction = kFriction;
    point.m_combinedRollingFriction = rolling;
    point.m_combinedSpinningFriction = rolling;
    point.m_combinedRestitution = 0;
    const auto known = std::find_if(kept.begin(), kept.end(),
                                    [&](const KeptContact& k) { return k.point == c.point && k.side == c.side; });
    if (known != kept.end()) {
      const btManifoldPoint& p = known->forces;
      point.m_appliedImpulse = p.m_appliedImpulse;
      // Friction keeps its two directions while the normal hardly turns.
      if (p.m_normalWorldOnB.dot(point.m_normalWorldOnB) > 0.99f) {
        point.m_contactPointFlags = p.m_contactPointFlags;
        point.m_lateralFrictionDir1 = p.m_lateralFrictionDir1;
        point.m_lateralFrictionDir2 = p.m_lateralFrictionDir2;
        point.m_appliedImpulseLateral1 = p.m_appliedImpulseLateral1;
        point.m_appliedImpulseLateral2 = p.m_appliedImpulseLateral2;
      }
    }
    manifold->addManifoldPoint(point);
  }
}

}  // namespace tribin::sim
