#include <algorithm>
#include <cmath>
#include <optional>

#include "contacts.hpp"
#include "seeds.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

// Room a side with which the open jaws must pass the part itself; a scene may open them wider, and looks again.
constexpr double kOpen_mm = 1, kGap_mm = 0.3;
// Contact of a jaw: two of the rays that feel it at least, so that it is no lone corner; as good as can be where it is
// half as large as a square of the jaw's width, since rounds touch along a line only.
constexpr double kLeastContact_mm2 = 12, kGoodContact = 0.5;
constexpr double kLeastMagnet = 0.7;
// A spare candidate nearer to another than that share of the part, in the same direction, is dropped.
constexpr double kNearShare = 0.1;

Vec3 mass_center(const Part& part, const MeshTree& tree) {
  Vec3 moment = Vec3::Zero();
  double volume = 0;
  const Vec3 origin = part.box_center();
  for (std::uint32_t t = 0; t < tree.count(); ++t) {
    const auto& c = tree.corners(t);
    const Vec3 a = c[0] - origin, b = c[1] - origin, d = c[2] - origin;
    const double v = a.dot(b.cross(d)) / 6;
    moment += v * (a + b + d) / 4;
    volume += v;
  }
  // An open mesh, or one of unknown winding, has no volume to speak of.
  const Vec3 center = origin + moment / volume;
  const bool good =
      volume > 0 && ((center - part.box_min).array() >= 0).all() && ((part.box_max - center).array() >= 0).all();
  return good ? center : origin;
}

/// A seed that holds.
std::optional<Candidate> tried(const GraspPart& known, int gripper, const Seed& seed) {
  const GripperShape& g = known.grippers[gripper];
  const MeshTree& tree = *known.tree;
  // A few rays tell most of those that hold nothing; what they miss between them makes angles and widths uncertain.
  constexpr double kRough = 2;
  if (g.jaws > 0 && !seed.taught) {
    const auto rough = close_jaws(tree, g, seed.part_from_tcp, false);
    if (!rough || rough->friction_angle > kRough * std::atan(g.gripper.friction)) return {};
  }
  const auto contacts = g.jaws > 0 ? close_jaws(tree, g, seed.part_from_tcp) : set_cup(tree, g, seed.part_from_tcp);
  if (!contacts) return {};
  const bool suction = g.gripper.kind == GripperKind::suction;
  const bool holds =
      g.jaws > 0 ? contacts->area_mm2 >= kLeastContact_mm2 && contacts->friction_angle <= std::atan(g.gripper.friction)
                 : contacts->share >= (suction ? 1 : kLeastMagnet);
  if (!holds && !seed.taught) return {};  // who taught it knows
  Candidate c;
  c.family = seed.family;
  c.gripper = gripper;
  c.priority = seed.priority;
  c.part_from_tcp = seed.taught ? seed.part_from_tcp : contacts->part_from_tcp;
  c.opening_mm = contacts->opening_mm;
  c.friction_angle = contacts->friction_angle;
  c.contact = contacts->share;
  const Vec3 arm = known.mass_center_mm - contacts->center;
  const Vec3 line = c.part_from_tcp.linear().col(g.jaws == 2 ? 0 : 2);
  c.offset_mm = (arm - arm.dot(line) * line).norm();
  if (g.jaws > 0) {
    const auto exact = exact_opening(tree, g, c.part_from_tcp, c.opening_mm);
    if (exact)
      c.opening_mm = *exact;
    else if (!seed.taught)
      return {};
    c.contact = std::min(1.0, contacts->area_mm2 / (kGoodContact * g.pad.width_mm * g.pad.width_mm));
    if (c.opening_mm < g.stroke_min() || c.opening_mm > g.stroke_max()) return {};
  }
  if (seed.taught) return c;
  const double room =
      g.jaws == 0 ? 0
                  : std::min(kOpen_mm, (g.inside ? c.opening_mm - g.stroke_min() : g.stroke_max() - c.opening_mm) / 2);
  const double open = g.inside ? c.opening_mm - 2 * room : c.opening_mm + 2 * room;
  if (!comes_free(tree, g, c.part_from_tcp, open, known.part->diameter_mm, std::min(kGap_mm, 0.5 * room + 1e-6)))
    return {};
  return c;
}

/// Whether no candidate stands near a place.
bool is_new(const Pose& place, const std::vector<Candidate>& known, std::size_t from, double near_mm) {
  constexpr double kTraceNear = 1 + 2 * 0.93;  // of R' R: 21 deg
  for (std::size_t i = from; i < known.size(); ++i) {
    const Pose& other = known[i].part_from_tcp;
    if ((other.translation() - place.translation()).squaredNorm() < near_mm * near_mm &&
        other.linear().cwiseProduct(place.linear()).sum() > kTraceNear)
      return false;
  }
  return true;
}

void add_candidates(GraspPart& known, int gripper) {
  const GripperShape& g = known.grippers[gripper];
  const std::vector<Seed> seeds = known.cell.pick_points.empty()
                                      ? seeds_of(*known.part, *known.tree, g, known.mass_center_mm)
                                      : taught_seeds(*known.part, known.cell, g.gripper.name);
  const std::size_t before = known.candidates.size();
  const double near_mm = kNearShare * known.part->diameter_mm;
  // Spare seeds are tried only where none of the others holds nearby.
  for (const bool spare : {false, true}) {
    std::vector<std::optional<Candidate>> found(seeds.size());
    parallel_ranges(static_cast<int>(seeds.size()), 16, [&](int begin, int end) {
      for (int i = begin; i < end; ++i)
        if (seeds[i].spare == spare && (!spare || is_new(seeds[i].part_from_tcp, known.candidates, before, near_mm)))
          found[i] = tried(known, gripper, seeds[i]);
    });
    for (const auto& candidate : found)
      if (candidate && (!spare || is_new(candidate->part_from_tcp, known.candidates, before, near_mm)))
        known.candidates.push_back(*candidate);
  }
  if (known.candidates.size() == before)
    known.warnings.push_back("part " + known.part->name + ": gripper " + g.gripper.name + " finds no hold (of " +
                             std::to_string(seeds.size()) + " places tried)");
}

}  // namespace

GraspPart prepare_grasps(const Part& part, const CellPart& cell, std::span<const Gripper> grippers) {
  GraspPart known;
  known.part = &part;
  known.cell = cell;
  known.tree = std::make_shared<const MeshTree>(part.mesh);
  known.mass_center_mm = mass_center(part, *known.tree);
  for (const Gripper& gripper : grippers) {
    const auto& names = cell.grippers;
    if (!names.empty() && std::find(names.begin(), names.end(), gripper.name) == names.end()) continue;
    known.grippers.push_back(gripper_shape(gripper));
    for (const std::string& warning : known.grippers.back().warnings) known.warnings.push_back(warning);
    add_candidates(known, static_cast<int>(known.grippers.size()) - 1);
  }
  return known;
}

}  // namespace tribin::grasp
