#include "contacts.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace tribin::grasp {
namespace {

// A pad is felt by rays from edge to edge, at first a few, then one every 3.5 mm: between two of those a round of 20 mm
// rises by 0.08 mm. A cup by rings of twelve.
constexpr int kFew = 5, kMost = 25, kRound = 12;
constexpr double kPitch_mm = 3.5;
// What lies within that of the first touch touches too: pads and parts give way by some tenths of a millimetre.
constexpr double kGivesWay_mm = 0.5;
// Three jaws that close together push a part that is not in their middle: by that much it is no matter.
constexpr double kPushed_mm = 2;
// A cup's lip follows a surface that far, and wants that much of it around.
constexpr double kLip_mm = 0.5, kAround_mm = 2;

struct JawTouch {
  double distance = 0;  ///< of the first touch from the TCP's axis
  Vec3 center = Vec3::Zero(), normal = Vec3::Zero();
  int rays = 0;
  double area_mm2 = 0;
};

/// How many rays feel a length.
int rays_over(double length_mm, bool finely) {
  return finely ? std::clamp(static_cast<int>(std::ceil(length_mm / kPitch_mm)) + 1, kFew, kMost) : kFew;
}

/// What one jaw meets first. \param k  which
std::optional<JawTouch> touch_of(const MeshTree& tree, const GripperShape& g, const Pose& part_from_tcp, int k,
                                 bool finely) {
  const int across_count = rays_over(g.pad.width_mm, finely), along_count = rays_over(g.pad.length_mm, finely);
  const double angle = k * 2 * kPi / g.jaws, far = g.stroke_max() / 2 + kPushed_mm;
  const Vec3 outward = part_from_tcp.linear() * Vec3(std::cos(angle), std::sin(angle), 0);
  const Vec3 across = part_from_tcp.linear() * Vec3(-std::sin(angle), std::cos(angle), 0);
  const Vec3 along = part_from_tcp.linear().col(2);
  const Vec3 direction = g.inside ? outward : Vec3(-outward);
  struct Felt {
    double t;
    Vec3 point, normal;
  };
  std::vector<Felt> felt;
  double first = 1e300;
  for (int i = 0; i < across_count; ++i)
    for (int j = 0; j < along_count; ++j) {
      const double y = g.pad.width_mm * (double(i) / (across_count - 1) - 0.5);
      const double z = g.pad.tip_mm - g.pad.length_mm * j / (along_count - 1);
      Vec3 from = part_from_tcp.translation() + y * across + z * along;
      if (!g.inside) from += far * outward;
      const auto hit = tree.first_hit(from, direction, far);
      if (!hit || tree.normal(hit->triangle).dot(direction) >= 0) continue;
      felt.push_back({hit->t, from + hit->t * direction, tree.normal(hit->triangle)});
      first = std::min(first, hit->t);
    }
  if (felt.empty()) return {};
  JawTouch touch;
  touch.distance = g.inside ? first : far - first;
  for (const Felt& f : felt) {
    if (f.t > first + kGivesWay_mm) continue;
    touch.center += f.point;
    touch.normal += f.normal;
    ++touch.rays;
  }
  touch.center /= touch.rays;
  touch.area_mm2 = touch.rays * (g.pad.width_mm / across_count) * (g.pad.length_mm / along_count);
  touch.normal.normalize();
  return touch;
}

double angle_between(const Vec3& a, const Vec3& b) { return std::acos(std::clamp(a.dot(b), -1.0, 1.0)); }

}  // namespace

std::optional<Contacts> close_jaws(const MeshTree& tree, const GripperShape& g, const Pose& part_from_tcp,
                                   bool finely) {
  std::vector<JawTouch> touches;
  for (int k = 0; k < g.jaws; ++k) {
    const auto touch = touch_of(tree, g, part_from_tcp, k, finely);
    if (!touch) return {};
    touches.push_back(*touch);
  }
  Contacts c;
  c.part_from_tcp = part_from_tcp;
  c.area_mm2 = 1e300;
  double sum = 0, least = 1e300, most = -1e300;
  for (const JawTouch& t : touches) {
    sum += t.distance;
    least = std::min(least, t.distance);
    most = std::max(most, t.distance);
    c.center += t.center / g.jaws;
    c.area_mm2 = std::min(c.area_mm2, t.area_mm2);
  }
  if (sum <= 0) return {};
  // Two jaws are put into the middle of what they touch; three must stand there already.
  if (g.jaws == 2)
    c.part_from_tcp.translation() += 0.5 * (touches[0].distance - touches[1].distance) * part_from_tcp.linear().col(0);
  else if (most - least > kPushed_mm)
    return {};
  c.opening_mm = 2 * sum / g.jaws;
  for (int k = 0; k < g.jaws; ++k) {
    // Two contacts are held along their line, three towards the middle of them.
    Vec3 line = g.jaws == 2 ? Vec3(touches[k].center - touches[1 - k].center) : Vec3(touches[k].center - c.center);
    if (line.norm() < 1e-9) return {};
    line.normalize();
    const Vec3 normal = g.inside ? Vec3(-touches[k].normal) : touches[k].normal;
    c.friction_angle = std::max(c.friction_angle, angle_between(line, normal));
  }
  return c;
}

std::optional<double> exact_opening(const MeshTree& tree, const GripperShape& g, const Pose& part_from_tcp,
                                    double opening_mm) {
  constexpr double kStep_mm = 0.1, kMost_mm = 2;
  const auto touches = [&](double opening) {
    return std::any_of(g.pieces.begin(), g.pieces.end(), [&](const GripperPiece& piece) {
      if (!piece.jaw) return false;
      Convex body = piece.body;
      body.frame_from_body.translation() += opening * piece.travel;
      return tree.gap_mm(moved(part_from_tcp, body), 1e-6) == 0;
    });
  };
  for (double more = 0; more <= kMost_mm; more += kStep_mm) {
    const double opening = g.inside ? opening_mm - more : opening_mm + more;
    if (!touches(opening)) return opening;
  }
  return {};
}

std::optional<Contacts> set_cup(const MeshTree& tree, const GripperShape& g, const Pose& part_from_tcp) {
  const Vec3 x = part_from_tcp.linear().col(0), y = part_from_tcp.linear().col(1), in = part_from_tcp.linear().col(2);
  const Vec3 at = part_from_tcp.translation();
  const double above = g.cup_mm;  // rays start that high: what rises there is in the cup's way
  const auto middle = tree.first_hit(at - above * in, in, 2 * above);
  if (!middle) return {};
  // A cup seals over all of its disc and a little more; a magnet holds by what it covers.
  const bool cup = g.gripper.kind == GripperKind::suction;
  const double radii[3] = {0.5 * g.cup_mm, cup ? g.cup_mm : 0.8 * g.cup_mm, cup ? g.cup_mm + kAround_mm : g.cup_mm};
  int touching = 1, rays = 1;
  Vec3 normal = tree.normal(middle->triangle);
  for (const double radius : radii)
    for (int k = 0; k < kRound; ++k) {
      const double angle = k * 2 * kPi / kRound;
      const Vec3 from = at + radius * (std::cos(angle) * x + std::sin(angle) * y) - above * in;
      const auto hit = tree.first_hit(from, in, 2 * above);
      ++rays;
      const double off = hit ? std::abs(hit->t - middle->t) : 2 * above;
      if (off > kLip_mm) continue;
      ++touching;
      normal += tree.normal(hit->triangle);
    }
  if (normal.norm() < 1e-9) return {};
  Contacts c;
  c.part_from_tcp = part_from_tcp;
  c.part_from_tcp.translation() = at + (middle->t - above) * in;
  c.share = double(touching) / rays;
  c.friction_angle = angle_between(-in, normal.normalized());
  c.center = c.part_from_tcp.translation();
  return c;
}

bool comes_free(const MeshTree& tree, const GripperShape& g, const Pose& part_from_tcp, double opening_mm,
                double way_mm, double gap_mm) {
  for (const GripperPiece& piece : g.pieces) {
    if (piece.jaw && g.jaws == 0) continue;  // the cup itself touches: see set_cup
    Convex body = piece.body;
    body.frame_from_body.translation() += opening_mm * piece.travel;
    body.sweep_mm = Vec3(0, 0, -way_mm);
    if (tree.gap_mm(moved(part_from_tcp, body), gap_mm) < gap_mm) return false;
  }
  return true;
}

}  // namespace tribin::grasp
