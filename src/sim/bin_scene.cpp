#include "tribin/sim/bin_scene.hpp"

#include <algorithm>
#include <cmath>

#include "sim/live_heap.hpp"
#include "sim/random.hpp"
#include "sim/rigid_world.hpp"
#include "sim/solid.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/recognition/bin.hpp"

namespace tribin::sim {
namespace {

constexpr int kStepsPerSecond = 240;
constexpr int kStepsBetween = 24;   // a part every 0.1 s: the one before has fallen half its size
constexpr double kDropSpeed = 600;  // mm/s at release: a fall of 18 mm
constexpr int kQuietAfter = 120;    // steps after the last drop, when damping begins to end rolling and rocking
constexpr int kLongest = 6 * 240;   // steps after the last drop, at most
constexpr double kDamping = 0.9;    // share of speed lost in a second, then
// Whatever has moved by less than 0.3 mm within a quarter of a second stays as it lies, from 1 s after the last drop
// on: dry friction holds parts that a solver lets creep.
constexpr double kStill = 0.3;
constexpr int kFreezeAfter = 240;
constexpr double kPatience = 2;
constexpr int kWindow = 60;

/// A rotation drawn evenly from all. \source Shoemake, Graphics Gems III, 1992.
Matrix3 drawn_rotation(Random& random) {
  const double u = random.uniform(), a = 2 * kPi * random.uniform(), b = 2 * kPi * random.uniform();
  const double s = std::sqrt(1 - u), c = std::sqrt(u);
  return Eigen::Quaterniond(c * std::cos(b), s * std::sin(a), s * std::cos(a), c * std::sin(b))
      .normalized()
      .toRotationMatrix();
}

/// Where a part starts to fall: turned as drawn, its box within the walls, above all others.
Pose start_of(const Solid& solid, double length, double width, double above, Random& random) {
  Pose pose = Pose::Identity();
  pose.linear() = drawn_rotation(random);
  Box box;
  for (const Vec3f& v : solid.mesh().vertices) {
    const Vec3 p = pose.linear() * Vec3(v.cast<double>());
    box.min = box.min.cwiseMin(p), box.max = box.max.cwiseMax(p);
  }
  constexpr double kClear = 2;  // mm to the walls
  const double room_x = std::max(0.0, (length - box.size().x()) / 2 - kClear),
               room_y = std::max(0.0, (width - box.size().y()) / 2 - kClear);
  const Vec3 middle(random.uniform(-room_x, room_x), random.uniform(-room_y, room_y),
                    above + box.size().z() / 2 + kClear);
  pose.translation() = middle - box.center();
  return pose;
}

/// Notes how deep a part reaches into floor and walls, how high it reaches, and how high it leans on the walls.
void note_walls(const Mesh& mesh, const Pose& pose, double length, double width, BinFill& fill) {
  constexpr double kLeans = 2;  // mm: more than parts that touch keep apart
  for (const Vec3f& v : mesh.vertices) {
    const Vec3 p = pose * Vec3(v.cast<double>());
    const double beyond = std::max(std::abs(p.x()) - length / 2, std::abs(p.y()) - width / 2);
    fill.max_overlap_mm = std::max({fill.max_overlap_mm, -p.z(), beyond});
    fill.top_mm = std::max(fill.top_mm, p.z());
    if (beyond > -kLeans) fill.wall_contact_mm = std::max(fill.wall_contact_mm, p.z());
  }
}

}  // namespace

Mesh bin_mesh(const Bin& bin) {
  return tribin::bin_mesh(BinShape{{bin.length_mm, bin.width_mm, bin.height_mm}, bin.wall_mm});
}

BinFill fill_bin(const std::vector<const Solid*>& parts, double length_mm, double width_mm, std::uint64_t seed) {
  for (const Solid* part : parts)
    if (part->diameter_mm() > std::min(length_mm, width_mm))
      throw Error(ErrorCode::out_of_range, part->mesh().name + " of diameter " + std::to_string(part->diameter_mm()) +
                                               " mm; wanted at most the bin's " +
                                               std::to_string(std::min(length_mm, width_mm)) + " mm");
  Random random(mixed(seed) ^ 0xB1Fu);
  RigidWorld world(length_mm, width_mm);
  int step = 0, last = 0;
  for (const Solid* part : parts) {
    double above = 0;
    for (int i = 0; i < world.size(); ++i) above = std::max(above, world.top_mm(i));
    world.add(*part, start_of(*part, length_mm, width_mm, above, random), Vec3(0, 0, -kDropSpeed));
    for (int i = 0; i < kStepsBetween; ++i, ++step) world.step();
    last = step;
  }
  std::vector<Pose> before(parts.size(), Pose::Identity());
  double drift = parts.empty() ? 0 : 1e30;
  for (; step < last + kLongest && drift > 0; ++step) {
    if (step == last + kQuietAfter) world.set_damping(kDamping);
    world.step();
    if ((step - last) % kWindow != kWindow - 1) continue;
    drift = 0;
    const double still =
        kStill * std::exp2(std::max(0.0, static_cast<double>(step - last) / kStepsPerSecond - kPatience));
    for (int i = 0; i < world.size(); ++i) {
      if (world.frozen(i)) continue;
      const Pose now = world.world_from_part(i);
      const double moved = largest_motion(*parts[i], before[i], now);
      before[i] = now;
      if (moved < still && step > last + kFreezeAfter)
        world.freeze(i);
      else
        drift = std::max(drift, moved);
    }
  }

  BinFill fill;
  fill.drift_mm = drift;
  fill.simulated_s = static_cast<double>(step) / kStepsPerSecond;
  for (int i = 0; i < world.size(); ++i) {
    fill.bin_from_part.push_back(world.world_from_part(i));
    note_walls(parts[i]->mesh(), fill.bin_from_part[i], length_mm, width_mm, fill);
  }
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t k = i + 1; k < parts.size(); ++k)
      fill.max_overlap_mm =
          std::max(fill.max_overlap_mm, overlap_mm(*parts[i], fill.bin_from_part[i], *parts[k], fill.bin_from_part[k]));
  return fill;
}

}  // namespace tribin::sim
