// The part in the hand, shown to the camera and measured.
#include <algorithm>

#include "picking/run.hpp"
#include "tribin/core/stage_times.hpp"

namespace tribin::picking {
namespace {

// Looks and grip contradict each other beyond this: by chance one in 10,000 (chi-square of six degrees of freedom, so
// many a look). Then the part has slipped farther than parts do, and the looks alone are believed.
constexpr double kChi2 = 28;

}  // namespace

Phase Run::with_part() const {
  return links_.cell->in_hand && now().in_hand->event != Event::measured ? Phase::show : Phase::place;
}

Phase Run::measured(const Entry& held, const HeldPose& pose) {
  Entry entry = held;
  entry.event = Event::measured;
  entry.cycle = 0;  // no order to the controller
  entry.tcp_from_part = pose.tcp_from_part;
  entry.sigma_mm = pose.sigma_mm();
  const Pose moved = pose.tcp_from_part * held.tcp_from_part.inverse();
  const Vec3 middle = held.tcp_from_part * links_.vision->model(held.part).box_center();
  report_.in_hand->measured = true;
  report_.in_hand->moved_mm = (moved * middle - middle).norm();
  report_.in_hand->moved = rotation_angle(moved.linear(), Matrix3::Identity());
  report_.in_hand->sigma_mm = entry.sigma_mm;
  journal_.write(entry);
  return Phase::place;
}

Phase Run::show() {
  const Entry held = *now().in_hand;
  if (!grip_)  // it was gripped before a crash, and how sure it was seen is not known any more
    grip_ = chooser_.grip_of(held.gripper, held.base_from_part * held.tcp_from_part.inverse(), held.tcp_from_part,
                             covariance_of_standing(*links_.cell), held.from_station);
  report_.in_hand.emplace();
  report_.in_hand->sigma_mm = held.sigma_mm;
  const Pose flange_from_tcp = chooser_.shape(held.gripper).gripper.flange_from_tcp;
  std::vector<HandLook> looks;
  bool otherwise = false;
  for (const Pose& base_from_flange : links_.cell->in_hand->looks) {
    const auto stops = chooser_.way_to_show(here(), base_from_flange, held, now().filling);
    if (!stops) {
      report_.in_hand->why = "where it would be shown is out of reach, or not clear of bin and rack";
      continue;
    }
    for (std::size_t i = 0; i < stops->size(); i += kMostStops) {
      Entry entry;
      entry.event = Event::move_ordered;
      entry.scene = scene_;
      const auto begin = stops->begin() + static_cast<std::ptrdiff_t>(i);
      order(entry, robot::CycleCommand::way_points,
            {begin, begin + static_cast<std::ptrdiff_t>(std::min(kMostStops, stops->size() - i))}, held.gripper, 0, 0);
    }
    StageTimes times;
    auto watch = std::make_optional<StageTimer>(times, "look");
    const HandSight sight = links_.vision->look_at_hand(
        held.part,
        {&chooser_.shape(held.gripper), held.holds_mm, base_from_flange * flange_from_tcp, held.tcp_from_part});
    watch.reset();
    report_.find_ms += times.total();
    if (sight.state == HandSight::State::gone) {
      Entry entry = held;
      entry.event = Event::lost;
      entry.cycle = 0;
      journal_.write(entry);
      tell("lost", "the part in the hand: " + sight.why);
      return Phase::scan;
    }
    if (sight.state == HandSight::State::unsure) {
      report_.in_hand->why = sight.why;
      continue;
    }
    if (sight.state == HandSight::State::otherwise) {
      looks.clear();
      otherwise = true;
      report_.in_hand->why = sight.why;
    }
    looks.push_back(sight.look);
    if (otherwise) break;
  }
  if (looks.empty()) return Phase::place;
  HeldPose pose = chooser_.held(*grip_, held.part, looks);
  if (otherwise || pose.chi2 > kChi2 * static_cast<double>(looks.size())) {
    if (!otherwise) report_.in_hand->why = "it slipped farther than parts do";
    pose = chooser_.held(*grip_, held.part, looks, false);
  } else {
    report_.in_hand->why.clear();
  }
  return measured(held, pose);
}

}  // namespace tribin::picking
