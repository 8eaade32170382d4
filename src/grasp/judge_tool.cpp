#include <algorithm>
#include <cmath>

#include "judge.hpp"

// All that the tool could touch on its way, cheapest first.
namespace tribin::grasp {
namespace {

// The open tool passes the part itself by that much at least; along the closing direction it has its room.
constexpr double kOwn_mm = 0.3;

/// The tool on each piece of its path: open on the way in, and as open on the way out (it holds less wide).
/// \param gap  (body, enough) -> its gap
template <class Gap>
Checked check_tool(Attempt& a, Why why, double clearance, const Gap& gap) {
  double least = std::max(a.clearance_mm, clearance);
  for (const auto& tool : a.moves)
    for (const Convex& body : tool) {
      least = std::min(least, gap(body, least));
      if (least < clearance) return Refusal{why, least, clearance};
    }
  a.clearance_mm = std::min(a.clearance_mm, least);
  return {};
}

Checked check_bodies(Attempt& a, const std::vector<Convex>& bodies, Why why, double clearance) {
  return check_tool(a, why, clearance, [&](const Convex& body, double enough) {
    double least = enough;
    for (const Convex& other : bodies) least = std::min(least, distance_mm(body, other, least));
    return least;
  });
}

Checked check_scan(const SceneFacts& facts, Attempt& a) {
  if (!a.around) return {};
  const double clearance =
      std::hypot(facts.options->clearance_mm, 3 * hand_eye_sigma(*facts.scene, a.base_from_tcp.translation()));
  return check_tool(a, Why::scan, clearance,
                    [&](const Convex& body, double enough) { return a.around->gap_mm(body, enough); });
}

/// The part itself, beside the jaws: the open tool passes it. Cups and magnets touch it with their front.
Checked check_own(const SceneFacts& facts, const Attempt& a) {
  const PartHere& here = facts.scene->parts[a.part];
  const Pose part_from_base = here.base_from_part.inverse();
  const double limit = std::min(kOwn_mm, 0.5 * a.room_mm);
  for (const auto& tool : a.moves)
    for (std::size_t k = 0; k < tool.size(); ++k) {
      if (a.gripper->jaws == 0 && a.gripper->pieces[k].jaw) continue;
      const double gap = here.part->tree->gap_mm(moved(part_from_base, tool[k]), limit);
      if (gap < limit) return Refusal{Why::part, gap, limit};
    }
  return {};
}

/// What lies between the jaws, or under a magnet, when they close: it would be taken along.
std::vector<Convex> closing_space(const Attempt& a) {
  const GripperShape& g = *a.gripper;
  if (g.inside) return {};
  const Pad& pad = g.pad;
  Pose middle = Pose::Identity();
  if (g.jaws == 2) {
    middle.translation().z() = pad.tip_mm - pad.length_mm / 2;
    return {moved(a.base_from_tcp, make_box(middle, Vec3(a.opening_before_mm, pad.width_mm, pad.length_mm)))};
  }
  if (g.jaws == 3)
    return {moved(a.base_from_tcp, make_cylinder(Vec3(0, 0, pad.tip_mm - pad.length_mm / 2), Vec3::UnitZ(),
                                                 a.opening_before_mm / 2, pad.length_mm))};
  return {moved(a.base_from_tcp, make_cylinder(Vec3::Zero(), Vec3::UnitZ(), g.cup_mm, 0))};
}

Checked check_parts(const SceneFacts& facts, Attempt& a) {
  if (const auto refusal = check_own(facts, a)) return refusal;
  const std::vector<Convex> between = closing_space(a);
  const Vec3 tcp = a.base_from_tcp.translation();
  double reach = a.gripper->stroke_max();
  for (const auto& tool : a.moves)
    for (const Convex& body : tool)
      reach = std::max(reach, (body.frame_from_body.translation() - tcp).norm() + body.half_mm.norm() + body.disc_mm +
                                  body.radius_mm + body.sweep_mm.norm());
  for (std::size_t j = 0; j < facts.parts.size(); ++j) {
    const PartFacts& other = facts.parts[j];
    if (static_cast<int>(j) == a.part || (other.center - tcp).norm() > other.radius_mm + reach + kFarGap_mm) continue;
    const PartHere& there = facts.scene->parts[j];
    const Pose part_from_base = there.base_from_part.inverse();
    const MeshTree& tree = *there.part->tree;
    const auto gap = [&](const Convex& body, double enough) {
      return tree.gap_mm(moved(part_from_base, body), enough);
    };
    if (const auto refusal = check_tool(a, Why::part, std::hypot(facts.options->clearance_mm, 3 * other.sigma_mm), gap))
      return refusal;
    for (const Convex& space : between)
      if (gap(space, kOwn_mm) < kOwn_mm) return Refusal{Why::held_part, gap(space, kOwn_mm), kOwn_mm};
  }
  return {};
}

}  // namespace

Checked check_tool_walls(const SceneFacts& facts, Attempt& a) {
  return check_bodies(a, facts.bin, Why::bin, facts.options->clearance_mm);
}

Checked check_tool_scene(const SceneFacts& facts, Attempt& a) {
  if (const auto refusal = check_scan(facts, a)) return refusal;
  if (const auto refusal = check_parts(facts, a)) return refusal;
  return check_bodies(a, facts.scene->obstacles, Why::obstacle, facts.options->clearance_mm);
}

}  // namespace tribin::grasp
