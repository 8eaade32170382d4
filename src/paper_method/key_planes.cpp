#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"
#include "tribin/paper_method/pose.hpp"
#include "tribin/paper_method/tests.hpp"

namespace tribin::paper {
namespace {

/// A plane within 20 degrees of square to the axis turns the spin by three times its own error or more.
const double kSquare = std::cos(20 * kDegree);
constexpr std::size_t kPlanePairs = 40;  ///< most similar areas first; a dozen planes a key cylinder are rare

using Planes = std::vector<const Primitive*>;

bool contains(const Planes& planes, const Primitive* p) {
  return std::find(planes.begin(), planes.end(), p) != planes.end();
}

/// Planes of the CAD whose faces touch the cylinder's: "intersected".
Planes intersected_with(const PrimitiveModel& model, const Primitive& cylinder) {
  Planes out;
  for (const Relation& r : model.relations) {
    if (r.type != RelationType::plane_cylinder || !r.adjacent) continue;
    if (r.first != cylinder.id && r.second != cylinder.id) continue;
    const int other = r.first == cylinder.id ? r.second : r.first;
    const Primitive& plane = model.primitives[static_cast<std::size_t>(other - 1)];
    if (plane.type == PrimitiveType::plane) out.push_back(&plane);
  }
  return out;
}

/// The same in a scan: supports closer than four cells, since along an edge the cells of both sides are mixed and
/// refused, and what is left of either begins a cell further on.
Planes intersected_with(const Planes& planes, const Primitive& cylinder, const Surfels& surfels) {
  Planes out;
  for (const Primitive* plane : planes) {
    const bool near = std::any_of(plane->surfels.begin(), plane->surfels.end(), [&](std::uint32_t i) {
      const float reach2 = 16 * surfels.area_mm2[i];
      return std::any_of(cylinder.surfels.begin(), cylinder.surfels.end(), [&](std::uint32_t j) {
        return (surfels.position[i] - surfels.position[j]).squaredNorm() < reach2;
      });
    });
    if (near) out.push_back(plane);
  }
  return out;
}

int shared(const Planes& a, const Planes& b) {
  return static_cast<int>(std::count_if(a.begin(), a.end(), [&](const Primitive* p) { return contains(b, p); }));
}

struct Side {
  Planes on_main, on_sub;
  int count() const { return static_cast<int>(on_main.size() + on_sub.size()) - shared(on_main, on_sub); }
};

/// Planes of both sides that lie alike to the same key cylinder; the tests' values go with them.
std::vector<Match> matched_planes(const KeyPair& key, const Side& seen, const Side& model, const Vec3& v1_seen,
                                  const Vec3& v1_model, const Check& check) {
  std::vector<Match> out;
  const auto match = [&](const Planes& from, const Planes& to, const Match& cylinder) {
    for (const Primitive* p : from)
      for (const Primitive* q : to) {
        if (std::any_of(out.begin(), out.end(), [&](const Match& m) { return m.seen == p && m.model == q; })) continue;
        const TestResult angle = plane_to_cylinder(p->axis, v1_seen, q->axis, v1_model);
        if (!check(angle)) continue;
        const TestResult area = area_similarity(*p, *cylinder.seen, *q, *cylinder.model);
        if (check(area)) out.push_back({p, q, {angle, area}});
      }
  };
  match(seen.on_main, model.on_main, key.main);
  match(seen.on_sub, model.on_sub, key.sub);
  std::stable_sort(out.begin(), out.end(),
                   [](const Match& a, const Match& b) { return a.tests[1].value > b.tests[1].value; });
  if (out.size() > kPlanePairs) out.resize(kPlanePairs);
  return out;
}

/// The four points of each plane with each key cylinder that it meets on both sides.
void add_points(const Match& plane, const KeyPair& key, const Side& seen, const Side& model, const Matrix3& frame_seen,
                const Matrix3& frame_model, std::vector<Vec3>& from, std::vector<Vec3>& to) {
  const Matrix3 rotation = frame_seen * frame_model.transpose();
  const auto add = [&](const Match& cylinder) {
    const auto p = intersection_points(*cylinder.seen, *plane.seen, frame_seen);
    const auto q = intersection_points(*cylinder.model, *plane.model, frame_model);
    for (int k = 0; k < 4; ++k) from.push_back(rotation * q[k]), to.push_back(p[k]);
  };
  if (contains(seen.on_main, plane.seen) && contains(model.on_main, plane.model)) add(key.main);
  const bool parallel = std::abs(key.main.model->axis.dot(key.sub.model->axis)) > std::cos(5 * kDegree);
  if (parallel && contains(seen.on_sub, plane.seen) && contains(model.on_sub, plane.model)) add(key.sub);
  if (from.empty()) {  // on the sub-cylinder alone, which is not parallel: the main one's points all the same
    add(key.main);
  }
}

}  // namespace

std::vector<PosedPair> posed_pairs(const KeyPair& key, const Object& object, const Surfels& surfels, const Part& part,
                                   const Check& check) {
  std::vector<PosedPair> out;
  const Side seen{intersected_with(object.planes, *key.main.seen, surfels),
                  intersected_with(object.planes, *key.sub.seen, surfels)};
  const Side model{intersected_with(part.model, *key.main.model), intersected_with(part.model, *key.sub.model)};
  const TestResult offset = axis_offset(*key.main.seen, *key.sub.seen);
  const bool two_axes = offset.passed && axis_offset(*key.main.model, *key.sub.model).passed;
  std::vector<TestResult> counts = {
      plane_on_cylinder(seen.count()), intersected_planes(seen.count(), model.count()),
      shared_planes(shared(seen.on_main, seen.on_sub), shared(model.on_main, model.on_sub))};
  for (const TestResult& test : counts)
    // "Two cylinders or one intersected plane" (IV-C): two axes that fix the rotation do without a plane.
    if (!check(test) && !(test.test == "plane_on_cylinder" && two_axes)) return out;
  counts.push_back(offset);

  const Vec3 v1_model = key.main.model->axis;
  for (const double sense : {1.0, -1.0}) {  // an axis and its opposite are one: both are tried
    const Vec3 v1_seen = sense * key.main.seen->axis;
    const std::vector<Match> planes = matched_planes(key, seen, model, v1_seen, v1_model, check);
    const auto pose = [&](const Match& base, const Match* second, const Vec3& third_seen, const Vec3& third_model) {
      const Matrix3 frame_seen = frame_of(v1_seen, third_seen), frame_model = frame_of(v1_model, third_model);
      std::vector<Vec3> from, to;
      add_points(base, key, seen, model, frame_seen, frame_model, from, to);
      if (second) add_points(*second, key, seen, model, frame_seen, frame_model, from, to);
      PosedPair posed{&key, counts, base, {}, frame_seen * frame_model.transpose(), mean_shift(from, to)};
      posed.agreement = base.tests[1].value;
      if (second) posed.second = *second, posed.agreement += second->tests[1].value;
      out.push_back(std::move(posed));
    };
    const Vec3 v3_seen = across(middle_of(*key.main.seen), middle_of(*key.sub.seen), v1_seen);
    const Vec3 v3_model = across(middle_of(*key.main.model), middle_of(*key.sub.model), v1_model);
    if (two_axes && planes.empty())
      out.push_back({&key, counts, {}, {}, frame_of(v1_seen, v3_seen) * frame_of(v1_model, v3_model).transpose()});
    for (const Match& base : planes) {
      if (two_axes) {
        pose(base, nullptr, v3_seen, v3_model);
        continue;
      }
      // Coaxial: the spin comes from a plane that is not square to the axis, the base or a second one beside it.
      for (const Match& second : planes) {
        if (std::abs(second.model->axis.dot(v1_model)) > kSquare) continue;
        if (second.seen == base.seen && second.model == base.model) {
          pose(base, nullptr, base.seen->axis, base.model->axis);
          continue;
        }
        if (second.seen == base.seen || second.model == base.model) continue;
        Match at_angle = second;
        at_angle.tests.push_back(
            plane_plane_angle(base.seen->axis, second.seen->axis, base.model->axis, second.model->axis));
        if (check(at_angle.tests.back())) pose(base, &at_angle, second.seen->axis, second.model->axis);
      }
    }
  }
  return out;
}

}  // namespace tribin::paper
