#include "seeds.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::grasp {
namespace {

// Directions are tried that far apart: a jaw's tilt by half of it is within any friction cone.
constexpr int kTurns = 24;
constexpr double kTurn = 2 * kPi / kTurns;
// A surface smaller than that share of the part's holds nothing worth a search; the largest ones are searched.
constexpr double kSmallShare = 0.002;
constexpr int kMostSurfaces = 40;

/// Places along a length, in the middle first, at most `pitch` apart where few will do.
std::vector<double> places(double low, double high, double pitch, int most) {
  if (high < low) return {0.5 * (low + high)};
  const int n = std::clamp(static_cast<int>((high - low) / pitch) + 1, 1, most);
  std::vector<double> out;
  for (int i = 0; i < n; ++i) out.push_back(n == 1 ? 0.5 * (low + high) : low + (high - low) * i / (n - 1));
  return out;
}

/// How far tips may stand beyond the middle of what they hold: just beyond, a little, as far as the pad's middle.
std::vector<double> depths(const Pad& pad, double width) {
  constexpr double kJust_mm = 2;
  std::vector<double> out = {std::min(kJust_mm, pad.length_mm / 2)};
  for (const double d : {std::min(width / 4, pad.length_mm / 2), std::min(width / 2, pad.length_mm / 2)})
    if (d > out.back() + kJust_mm) out.push_back(d);
  return out;
}

std::vector<const Primitive*> largest(const Part& part, std::initializer_list<PrimitiveType> types, bool concave) {
  std::vector<const Primitive*> out;
  for (const Primitive& p : part.model.primitives)
    if (std::find(types.begin(), types.end(), p.type) != types.end() && p.concave == concave && !p.fillet &&
        p.area_mm2 >= kSmallShare * part.area_mm2)
      out.push_back(&p);
  std::stable_sort(out.begin(), out.end(),
                   [](const Primitive* a, const Primitive* b) { return a->area_mm2 > b->area_mm2; });
  if (static_cast<int>(out.size()) > kMostSurfaces) out.resize(kMostSurfaces);
  return out;
}

std::string called(const Primitive& p, const char* how) {
  return std::string(name_of(p.type)) + " " + std::to_string(p.id) + " " + how;
}

class Seeder {
 public:
  Seeder(const Part& part, const MeshTree& tree, const GripperShape& gripper, const Vec3& center)
      : part_(part), tree_(tree), gripper_(gripper), pad_(gripper.pad), center_(center) {}

  std::vector<Seed> all() {
    if (gripper_.jaws == 0) {
      on_planes();
      on_cylinders();
    } else if (gripper_.jaws == 3) {
      along_axes(false);
      on_balls();
    } else if (gripper_.inside) {
      along_axes(true);
      between_faces(true);
    } else {
      across_cylinders();
      along_axes(false);
      between_faces(false);
      on_balls();
      through_points();
    }
    return std::move(seeds_);
  }

 private:
  void add(const Vec3& at, const Vec3& closing, const Vec3& approach, double beyond, const std::string& family) {
    seeds_.push_back({tcp_at(at + (beyond - pad_.tip_mm) * approach, closing, approach), family});
  }

  bool fits(double width) const { return width >= gripper_.stroke_min() && width <= gripper_.stroke_max(); }

  /// The surface's middle along its axis, its ends, and its radius at a place.
  static Vec3 on_axis(const Primitive& p, double s) { return p.point + s * p.axis; }
  static double radius_at(const Primitive& p, double s) {
    return p.type == PrimitiveType::cone ? s * std::tan(p.half_angle) : p.radius_mm;
  }

  void across_cylinders() {
    for (const Primitive* p : largest(part_, {PrimitiveType::cylinder, PrimitiveType::cone}, false)) {
      Vec3 u, v;
      orthonormal_basis(p->axis, u, v);
      const double edge = std::min(pad_.width_mm / 2, p->height_mm() / 2);
      std::vector<double> s = places(p->extent_min + edge, p->extent_max - edge, pad_.width_mm, 5);
      const double middle = (center_ - p->point).dot(p->axis);
      if (middle > p->extent_min && middle < p->extent_max) s.push_back(middle);
      for (const double at : s) {
        const double width = 2 * radius_at(*p, at);
        if (!fits(width)) continue;
        for (int k = 0; k < kTurns; ++k) {
          const Vec3 approach = std::cos(k * kTurn) * u + std::sin(k * kTurn) * v;
          for (const double d : depths(pad_, width))
            add(on_axis(*p, at), approach.cross(p->axis), approach, d, called(*p, "radial"));
        }
      }
    }
  }

  /// From both ends: outside with the tips beside the round, inside with the tips in the bore.
  void along_axes(bool bores) {
    for (const Primitive* p : largest(part_, {PrimitiveType::cylinder, PrimitiveType::cone}, bores)) {
      Vec3 u, v;
      orthonormal_basis(p->axis, u, v);
      for (const int side : {-1, 1}) {
        const Vec3 approach = -side * p->axis;
        const double end = side > 0 ? p->extent_max : p->extent_min, length = p->height_mm();
        const double width =
            2 * std::max(radius_at(*p, end), radius_at(*p, end - side * std::min(length, pad_.length_mm)));
        if (!fits(width) && p->type != PrimitiveType::cone) continue;
        const double deep = std::min(length, pad_.length_mm);
        for (const double d : places(std::min(4.0, deep), deep, 10, 3))
          // Two jaws look the same after half a turn, three after a third.
          for (int k = 0; k < kTurns / gripper_.jaws; ++k)
            add(on_axis(*p, end), std::cos(k * kTurn) * u + std::sin(k * kTurn) * v, approach, d,
                called(*p, bores ? "bore" : "end"));
      }
    }
  }

  void on_balls() {
    for (const Primitive* p : largest(part_, {PrimitiveType::sphere}, false)) {
      if (!fits(2 * p->radius_mm)) continue;
      for (const Vec3f& direction : golden_spiral(32))
        for (const int side : {-1, 1}) {
          const Vec3 approach = side * direction.cast<double>().normalized();
          Vec3 u, v;
          orthonormal_basis(approach, u, v);
          for (int k = 0; k < 4; ++k) {
            const double angle = k * kPi / (2 * gripper_.jaws);
            add(p->point, std::cos(angle) * u + std::sin(angle) * v, approach,
                std::min(p->radius_mm / 2, pad_.length_mm / 2), called(*p, "ball"));
          }
        }
    }
  }

  /// Places on a plane's own triangles: a grid of them, the one beside the mass centre first.
  std::vector<Vec3> places_on(const Primitive& p, double pitch, int most) const {
    Vec3 u, v;
    orthonormal_basis(p.axis, u, v);
    Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);
    for (std::uint32_t t = 0; t < tree_.count(); ++t) {
      if (part_.primitive_of_triangle[t] != p.id) continue;
      for (const Vec3& c : tree_.corners(t)) {
        const Vec3 flat((c - p.point).dot(u), (c - p.point).dot(v), 0);
        low = low.cwiseMin(flat);
        high = high.cwiseMax(flat);
      }
    }
    std::vector<Vec3> out;
    const auto try_at = [&](double a, double b) {
      constexpr double kAbove_mm = 1;
      const Vec3 at = p.point + a * u + b * v;
      const auto hit = tree_.first_hit(at + kAbove_mm * p.axis, -p.axis, 2 * kAbove_mm);
      if (hit && part_.primitive_of_triangle[hit->triangle] == p.id) out.push_back(at);
    };
    if (low.x() > high.x()) return out;
    try_at((center_ - p.point).dot(u), (center_ - p.point).dot(v));
    // Centres of equal cells: no place lies on the rim.
    const int nu = std::clamp(static_cast<int>((high.x() - low.x()) / pitch), 1, most);
    const int nv = std::clamp(static_cast<int>((high.y() - low.y()) / pitch), 1, most);
    for (int i = 0; i < nu; ++i)
      for (int j = 0; j < nv; ++j)
        try_at(low.x() + (high.x() - low.x()) * (i + 0.5) / nu, low.y() + (high.y() - low.y()) * (j + 0.5) / nv);
    return out;
  }

  /// Jaws on two faces that look away from each other, or, inside, at each other.
  void between_faces(bool slots) {
    for (const Primitive* p : largest(part_, {PrimitiveType::plane}, false)) {
      Vec3 u, v;
      orthonormal_basis(p->axis, u, v);
      for (const Vec3& at : places_on(*p, std::max(pad_.width_mm / 2, 8.0), 4)) {
        const Vec3 through = slots ? p->axis : Vec3(-p->axis);
        constexpr double kOff_mm = 0.01;  // from the face itself
        const auto hit = tree_.first_hit(at + kOff_mm * through, through, gripper_.stroke_max());
        if (!hit) continue;
        const double facing = tree_.normal(hit->triangle).dot(through);
        if ((slots ? -facing : facing) < std::cos(std::atan(gripper_.gripper.friction))) continue;
        const int other = part_.primitive_of_triangle[hit->triangle];
        const double width = hit->t + kOff_mm;
        // A pair is found from both of its faces; one will do.
        const bool pair = other > 0 && part_.model.primitives[other - 1].type == PrimitiveType::plane;
        if (!fits(width) || (pair && other < p->id)) continue;
        const std::string family =
            (slots ? "slot " : "planes ") + std::to_string(p->id) + " and " + std::to_string(other);
        for (int k = 0; k < kTurns; ++k) {
          const Vec3 approach = std::cos(k * kTurn) * u + std::sin(k * kTurn) * v;
          for (const double d : depths(pad_, width)) add(at + 0.5 * width * through, through, approach, d, family);
        }
      }
    }
  }

  /// What no primitive tells: points all over the surface, and what lies opposite of them.
  void through_points() {
    constexpr std::size_t kPoints = 120;
    const std::size_t count = part_.sample_points.size(), step = std::max<std::size_t>(1, count / kPoints);
    for (std::size_t i = step / 2; i < count; i += step) {
      const Vec3 in = -part_.sample_normals[i].cast<double>().normalized();
      const Vec3 at = part_.sample_points[i].cast<double>();
      constexpr double kOff_mm = 0.01;  // from the surface itself
      const auto hit = tree_.first_hit(at + kOff_mm * in, in, gripper_.stroke_max());
      if (!hit || !fits(hit->t + kOff_mm)) continue;
      if (tree_.normal(hit->triangle).dot(in) < std::cos(std::atan(gripper_.gripper.friction))) continue;
      Vec3 u, v;
      orthonormal_basis(in, u, v);
      for (int k = 0; k < kTurns; k += 2) {
        const Vec3 approach = std::cos(k * kTurn) * u + std::sin(k * kTurn) * v;
        for (const double d : depths(pad_, hit->t)) {
          add(at + 0.5 * hit->t * in, in, approach, d, "points");
          seeds_.back().spare = true;
        }
      }
    }
  }

  void add_cup(const Vec3& at, const Vec3& outward, const std::string& family) {
    Vec3 u, v;
    orthonormal_basis(outward, u, v);
    for (int k = 0; k < kTurns; k += 3)  // the cup does not mind; flange and body may
      seeds_.push_back({tcp_at(at, std::cos(k * kTurn) * u + std::sin(k * kTurn) * v, -outward), family});
  }

  void on_planes() {
    for (const Primitive* p : largest(part_, {PrimitiveType::plane}, false))
      for (const Vec3& at : places_on(*p, std::max(gripper_.cup_mm / 2, 3.0), 7))
        add_cup(at, p->axis, called(*p, "cup"));
  }

  void on_cylinders() {
    // The round falls off under the lip by r - sqrt(r^2 - R^2); the triangles decide, this only saves time.
    constexpr double kFalls_mm = 1;
    for (const Primitive* p : largest(part_, {PrimitiveType::cylinder}, false)) {
      const double r = p->radius_mm, cup = gripper_.cup_mm;
      if (cup >= r || r - std::sqrt(r * r - cup * cup) > kFalls_mm) continue;
      Vec3 u, v;
      orthonormal_basis(p->axis, u, v);
      for (const double s : places(p->extent_min + cup, p->extent_max - cup, cup, 5))
        for (int k = 0; k < kTurns; ++k) {
          const Vec3 outward = std::cos(k * kTurn) * u + std::sin(k * kTurn) * v;
          add_cup(on_axis(*p, s) + r * outward, outward, called(*p, "cup"));
        }
    }
  }

  const Part& part_;
  const MeshTree& tree_;
  const GripperShape& gripper_;
  const Pad& pad_;
  Vec3 center_;
  std::vector<Seed> seeds_;
};

Pose turned_about(const Vec3& point, const Vec3& axis, double angle) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(angle * axis);
  pose.translation() = point - pose.linear() * point;
  return pose;
}

}  // namespace

Pose tcp_at(const Vec3& at, const Vec3& closing, const Vec3& approach) {
  Pose pose = Pose::Identity();
  pose.linear().col(0) = closing;
  pose.linear().col(1) = approach.cross(closing);
  pose.linear().col(2) = approach;
  pose.translation() = at;
  return pose;
}

std::vector<Seed> seeds_of(const Part& part, const MeshTree& tree, const GripperShape& gripper,
                           const Vec3& mass_center_mm) {
  return Seeder(part, tree, gripper, mass_center_mm).all();
}

std::vector<Seed> taught_seeds(const Part& part, const CellPart& cell, const std::string& gripper) {
  std::vector<Pose> same = part.symmetry.discrete;
  if (same.empty()) same.push_back(Pose::Identity());
  for (const ContinuousSymmetry& axis : part.symmetry.continuous) {
    std::vector<Pose> turned;
    for (int k = 0; k < kTurns; ++k)
      for (const Pose& pose : same) turned.push_back(turned_about(axis.point, axis.axis, k * kTurn) * pose);
    same = std::move(turned);
    break;  // a ball's other axes: its turns about one and the allowed tilt must do
  }
  std::vector<Seed> out;
  for (const PickPoint& point : cell.pick_points) {
    if (!point.gripper.empty() && point.gripper != gripper) continue;
    std::vector<Pose> leans = {Pose::Identity()};
    if (point.tilt_rad > 0)
      for (const double share : {0.5, 1.0})
        for (int k = 0; k < 8; ++k) {
          const double angle = k * kPi / 4;
          leans.push_back(
              turned_about(Vec3::Zero(), Vec3(std::cos(angle), std::sin(angle), 0), share * point.tilt_rad));
        }
    const int rolls = static_cast<int>(point.roll_rad / kTurn + 1e-9);
    for (const Pose& symmetric : same)
      for (const Pose& lean : leans)
        for (int k = -rolls; k <= rolls; ++k) {
          if (2 * rolls == kTurns && k == -rolls) continue;  // half a turn to either side is the same
          const Pose roll = turned_about(Vec3::Zero(), Vec3::UnitZ(), k * kTurn);
          out.push_back({symmetric * point.part_from_tcp * lean * roll,
                         point.name.empty() ? "taught" : "taught " + point.name, point.priority, true, false});
        }
  }
  return out;
}

}  // namespace tribin::grasp
