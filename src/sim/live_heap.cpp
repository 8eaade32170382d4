#include "sim/live_heap.hpp"

#include <algorithm>
#include <cmath>

#include "sim/solid.hpp"

namespace tribin::sim {
namespace {

constexpr int kWindow = 60;     // steps: a quarter of a second
constexpr double kStill = 0.3;  // mm in a window: dry friction holds what a solver lets creep, as in fill_bin
constexpr int kPatience = 8;    // windows; what creeps longer is let creep twice as far a window each time
constexpr int kLook = 12;       // steps between looks at what a falling part wakes
constexpr double kTouch = 0.5;  // mm: parts at rest keep up to 0.3 mm apart
constexpr double kDamping = 0.9;
constexpr double kFar = 1e5;

Pose far_away(int number) {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3(kFar, kFar, kFar + 1e3 * number);
  return pose;
}

}  // namespace

double largest_motion(const Solid& solid, const Pose& from, const Pose& to) {
  const Vec3 centre = solid.state().part_from_body.translation();
  return (to * centre - from * centre).norm() + rotation_angle(from.linear(), to.linear()) * solid.diameter_mm();
}

LiveHeap::LiveHeap(const Bin& bin, const std::vector<const Solid*>& parts, const std::vector<Pose>& bin_from_part)
    : bin_(bin), world_(bin.length_mm, bin.width_mm), parts_(static_cast<int>(parts.size())), solids_(parts) {
  for (int i = 0; i < parts_; ++i) {
    world_.add(*parts[i], bin_from_part[i], Vec3::Zero());
    world_.freeze(i);
  }
  world_.set_damping(kDamping);
  state_.assign(parts.size(), State::still);
  pose_ = before_ = rest_ = bin_from_part;
}

int LiveHeap::add_tool(const Solid& piece) {
  const int number = bodies();
  world_.add(piece, far_away(number), Vec3::Zero());
  world_.guide(number);
  solids_.push_back(&piece);
  state_.push_back(State::guided);
  pose_.push_back(far_away(number));
  before_.push_back(pose_.back());
  rest_.push_back(pose_.back());
  return number;
}

void LiveHeap::move(int body, const Pose& bin_from_body) {
  pose_[body] = bin_from_body;
  world_.move(body, bin_from_body, at_rest());
}

void LiveHeap::wake(int part) {
  if (state_[part] != State::still) return;
  world_.thaw(part);
  state_[part] = State::awake;
  before_[part] = pose_[part];
  ++awake_;
}

void LiveHeap::wake_neighbours(int body, double reach) {
  for (int k = 0; k < parts_; ++k)
    if (k != body && state_[k] == State::still && world_.boxes_meet(body, k, reach) && world_.depth_mm(body, k, reach))
      wake(k);
}

void LiveHeap::hold(int part) {
  if (state_[part] == State::awake) --awake_;
  wake_neighbours(part, kTouch);
  world_.guide(part);
  state_[part] = State::guided;
}

void LiveHeap::let_go(int part) {
  world_.let_go(part);
  state_[part] = State::awake;
  before_[part] = pose_[part];
  ++awake_;
}

void LiveHeap::stand(int part) {
  if (state_[part] == State::awake) --awake_;
  world_.freeze(part);
  state_[part] = State::standing;
}

void LiveHeap::step() {
  for (int b = 0; b < bodies(); ++b)
    if (state_[b] == State::guided && pose_[b].translation().norm() < kFar / 2) wake_neighbours(b, kTouch);
  if (at_rest()) return;
  world_.step();
  ++steps_;
  for (int i = 0; i < parts_; ++i)
    if (state_[i] == State::awake) pose_[i] = world_.world_from_part(i);
  if (steps_ % kLook == 0)
    for (int i = 0; i < parts_; ++i)
      if (state_[i] == State::awake && largest_motion(*solids_[i], before_[i], pose_[i]) > kStill)
        wake_neighbours(i, kTouch);
  if (steps_ % kWindow != 0) return;
  const double still = kStill * std::exp2(std::max(0, steps_ / kWindow - kPatience));
  for (int i = 0; i < parts_; ++i) {
    if (state_[i] != State::awake) continue;
    const double moved = largest_motion(*solids_[i], before_[i], pose_[i]);
    before_[i] = pose_[i];
    if (moved >= still) continue;
    world_.freeze(i);
    state_[i] = State::still;
    rest_[i] = pose_[i];
    --awake_;
  }
  if (at_rest()) steps_ = 0;
}

double LiveHeap::moved_mm(int part) const { return largest_motion(*solids_[part], rest_[part], pose_[part]); }

double LiveHeap::depth_in_walls_mm(int body) const {
  // Floor and walls as boxes; a point's depth in a box is its way out to the nearest side that is not buried in
  // another.
  const Vec3 inner(bin_.length_mm / 2, bin_.width_mm / 2, bin_.height_mm);
  const Pose& pose = pose_[body];
  const PointShell& shell = solids_[body]->state().shell;
  const PointShell::Node& all = shell.nodes.front();
  const Vec3 centre = pose * all.centre.cast<double>();
  if (centre.z() - all.radius > bin_.height_mm) return 0;
  double deepest = 0;
  for (const Vec3f& point : shell.points) {
    const Vec3 p = pose * point.cast<double>();
    const double below_rim = bin_.height_mm - p.z(), above_ground = p.z() + bin_.wall_mm;
    if (below_rim <= 0 || above_ground <= 0) continue;
    const double x = std::abs(p.x()) - inner.x(), y = std::abs(p.y()) - inner.y();
    const double in_x = std::min(x, bin_.wall_mm - x), in_y = std::min(y, bin_.wall_mm - y);
    const bool within_x = x < bin_.wall_mm, within_y = y < bin_.wall_mm;
    if (in_x > 0 && within_y) deepest = std::max(deepest, std::min(in_x, below_rim));
    if (in_y > 0 && within_x) deepest = std::max(deepest, std::min(in_y, below_rim));
    if (p.z() < 0 && x < 0 && y < 0) deepest = std::max(deepest, -p.z());
  }
  return deepest;
}

}  // namespace tribin::sim
