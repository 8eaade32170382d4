#include "contacts.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace tribin {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// A point of one body inside of the other.
struct Contact {
  std::size_t inner = 0, outer = 0;  ///< whose point, and in whom
  Eigen::Vector3d point;             ///< camera frame
  Eigen::Vector3d outward;           ///< the way out of the outer one, camera frame, unit
  double depth_mm = 0;
  Vec6 inner_at = Vec6::Zero(), outer_at = Vec6::Zero();  ///< motions of both when it was found
};

/// How the way out grows with a body's (dt, w), rotations about its origin.
Vec6 gradient(const Body& body, const Eigen::Vector3d& point, const Eigen::Vector3d& outward) {
  Vec6 out;
  out << outward, (point - body.camera_from_body.translation()).cross(outward);
  return out;
}

double variance(const Body& body, const Contact& contact) {
  const Vec6 g = gradient(body, contact.point, contact.outward);
  return g.dot(Mat6(body.covariance) * g);
}

void find_contacts(std::span<const Body> bodies, std::size_t inner, std::size_t outer, std::vector<Contact>& out) {
  const Body& a = bodies[inner];
  const Body& b = bodies[outer];
  const Pose b_from_a = b.camera_from_body.inverse() * a.camera_from_body;
  for (std::size_t k = 0; k < a.points.size(); ++k) {
    const Eigen::Vector3d p = a.points[k].cast<double>(), n = a.normals[k].cast<double>();
    const auto depth = b.solid->depth(Vec3(b_from_a * p), Vec3(b_from_a.linear() * n));
    if (!depth) continue;
    Contact contact;
    contact.inner = inner, contact.outer = outer;
    contact.point = a.camera_from_body * p;
    contact.outward = b.camera_from_body.linear() * Eigen::Vector3d(depth->outward);
    contact.depth_mm = depth->mm;
    out.push_back(contact);
  }
}

bool boxes_meet(const Body& a, const Body& b) {
  // The box of a in the frame of b, around its turned box.
  const Pose b_from_a = b.camera_from_body.inverse() * a.camera_from_body;
  const Eigen::Vector3d center = b_from_a * Eigen::Vector3d(0.5 * (a.solid->low() + a.solid->high()));
  const Eigen::Vector3d half = b_from_a.linear().cwiseAbs() * Eigen::Vector3d(0.5 * (a.solid->high() - a.solid->low()));
  const Eigen::Vector3d low = center - half, high = center + half;
  return (low.array() <= b.solid->high().array()).all() && (high.array() >= b.solid->low().array()).all();
}

/// Points of one body in the other, deepest first: those of the one direction in which the two are least deep in each
/// other. Points beside that contact are inside too, and lead the long way out.
std::vector<Contact> contacts_of(std::span<const Body> bodies, std::size_t a, std::size_t b) {
  if (!boxes_meet(bodies[a], bodies[b]) || !boxes_meet(bodies[b], bodies[a])) return {};
  std::vector<Contact> all;
  find_contacts(bodies, a, b, all);
  find_contacts(bodies, b, a, all);
  std::stable_sort(all.begin(), all.end(), [](const Contact& x, const Contact& y) { return x.depth_mm > y.depth_mm; });
  std::vector<std::vector<Contact>> groups;  // each of directions within 30 deg of its deepest, out of b
  const auto out_of_b = [&](const Contact& c) { return Eigen::Vector3d(c.outer == b ? c.outward : -c.outward); };
  for (const Contact& c : all) {
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const std::vector<Contact>& g) {
      return out_of_b(g.front()).dot(out_of_b(c)) > 0.87;
    });
    if (group != groups.end())
      group->push_back(c);
    else
      groups.push_back({c});
  }
  // A strip of points along an edge is no contact beside a face: of the groups that are not much smaller than the
  // largest, the least deep.
  std::size_t most = 0;
  for (const auto& g : groups) most = std::max(most, g.size());
  const std::vector<Contact>* least = nullptr;
  for (const auto& g : groups)
    if (4 * g.size() >= most && (least == nullptr || g.front().depth_mm < least->front().depth_mm)) least = &g;
  return least == nullptr ? std::vector<Contact>() : *least;
}

double limit_of(std::span<const Body> bodies, const Contact& c) {
  const Body& inner = bodies[c.inner];
  const Body& outer = bodies[c.outer];
  return inner.tolerance_mm + outer.tolerance_mm + 3 * std::sqrt(variance(inner, c) + variance(outer, c));
}

double deepest(const std::vector<Contact>& contacts) { return contacts.empty() ? 0 : contacts.front().depth_mm; }

/// The motion of a body from its own pose.
Vec6 motion(const Pose& own, const Pose& now) {
  Vec6 out;
  out << now.translation() - own.translation(), vector_from_rotation(Matrix3(now.linear() * own.linear().transpose()));
  return out;
}

/// How deep each pair may be in each other, by a * n + b.
using Allowed = std::vector<double>;

/// The deepest contacts of each pair that is deeper than it may be, as the bodies stand now, beside those that were
/// found before. Their depth is what is too much.
/// \return whether there are any
bool add_contacts(std::span<const Body> bodies, const std::vector<Pose>& own, const Allowed& allowed,
                  std::vector<Contact>& all) {
  constexpr std::size_t kMost = 32;  // a pair: what is less deep comes in the next steps
  bool any = false;
  for (std::size_t a = 0; a < bodies.size(); ++a)
    for (std::size_t b = a + 1; b < bodies.size(); ++b) {
      std::vector<Contact> between = contacts_of(bodies, a, b);
      if (between.size() > kMost) between.resize(kMost);
      for (Contact& c : between) {
        c.depth_mm -= allowed[a * bodies.size() + b];
        if (c.depth_mm < 1e-3) continue;  // a micrometre is none
        c.inner_at = motion(own[c.inner], bodies[c.inner].camera_from_body);
        c.outer_at = motion(own[c.outer], bodies[c.outer].camera_from_body);
        all.push_back(c);
        any = true;
      }
    }
  return any;
}

/// Moves the bodies by the least, from their own poses, that undoes the contacts, linear as they are.
void push_apart(std::span<Body> bodies, const std::vector<Pose>& own, const std::vector<Contact>& contacts) {
  struct Row {
    Vec6 inner, outer, inner_motion, outer_motion;  ///< gradients, and what a unit of force does
    double response = 0, force = 0;
  };
  std::vector<Row> rows;
  for (const Contact& c : contacts) {
    Row row;
    row.inner = gradient(bodies[c.inner], c.point, c.outward);
    row.outer = gradient(bodies[c.outer], c.point, c.outward);
    const auto motion_of = [](const Body& body, const Vec6& force) {
      return body.fixed ? Vec6(Vec6::Zero()) : Vec6(Mat6(body.covariance) * force);
    };
    row.inner_motion = motion_of(bodies[c.inner], row.inner);
    row.outer_motion = motion_of(bodies[c.outer], row.outer);
    row.response = row.inner.dot(row.inner_motion) + row.outer.dot(row.outer_motion);
    rows.push_back(row);
  }
  std::vector<Vec6> x(bodies.size(), Vec6::Zero());
  constexpr int kSweeps = 100;
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const Contact& c = contacts[k];
      Row& row = rows[k];
      if (!(row.response > 1e-12)) continue;
      const double gap = row.inner.dot(x[c.inner] - c.inner_at) - row.outer.dot(x[c.outer] - c.outer_at) - c.depth_mm;
      const double force = std::max(0.0, row.force - gap / row.response);
      x[c.inner] += row.inner_motion * (force - row.force);
      x[c.outer] -= row.outer_motion * (force - row.force);
      row.force = force;
    }
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (!x[i].isZero()) bodies[i].camera_from_body = moved(own[i], Vector6(x[i]));
}

}  // namespace

std::vector<Overlap> overlaps(std::span<const Body> bodies) {
  std::vector<Overlap> out;
  for (std::size_t a = 0; a < bodies.size(); ++a)
    for (std::size_t b = a + 1; b < bodies.size(); ++b) {
      Overlap worst{a, b};
      double most = 0;
      for (const Contact& c : contacts_of(bodies, a, b)) {
        const double limit = limit_of(bodies, c);
        if (c.depth_mm - limit <= most) continue;
        most = c.depth_mm - limit;
        worst.depth_mm = c.depth_mm;
        worst.limit_mm = limit;
      }
      if (most > 0) out.push_back(worst);
    }
  return out;
}

void separate(std::span<Body> bodies, std::span<const Overlap> overlap) {
  // Bodies whose boxes meet, directly or by others between them, are looked at together.
  const std::size_t n = bodies.size();
  std::vector<std::size_t> component(n);
  std::iota(component.begin(), component.end(), std::size_t{0});
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) {
      const std::size_t from = std::max(component[a], component[b]), to = std::min(component[a], component[b]);
      if (from == to || !boxes_meet(bodies[a], bodies[b]) || !boxes_meet(bodies[b], bodies[a])) continue;
      std::replace(component.begin(), component.end(), from, to);
    }
  for (std::size_t id = 0; id < n; ++id) {
    if (std::none_of(overlap.begin(), overlap.end(), [&](const Overlap& o) { return component[o.a] == id; })) continue;
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < n; ++i)
      if (component[i] == id) members.push_back(i);
    std::vector<Body> group;
    std::vector<Pose> own;
    for (const std::size_t i : members) {
      group.push_back(bodies[i]);
      own.push_back(bodies[i].camera_from_body);
    }
    // What does not overlap may stay as deep as it is.
    const std::size_t m = members.size();
    Allowed before(m * m, 0.0), allowed(m * m, 0.0);
    for (std::size_t a = 0; a < m; ++a)
      for (std::size_t b = a + 1; b < m; ++b) {
        before[a * m + b] = deepest(contacts_of(group, a, b));
        const bool overlaps = std::any_of(overlap.begin(), overlap.end(),
                                          [&](const Overlap& o) { return o.a == members[a] && o.b == members[b]; });
        if (!overlaps) allowed[a * m + b] = before[a * m + b];
      }
    std::vector<Contact> contacts;
    constexpr int kSteps = 6;  // contacts move along the surfaces as bodies turn
    for (int step = 0; step < kSteps && add_contacts(group, own, allowed, contacts); ++step)
      push_apart(group, own, contacts);
    bool deeper = false;
    for (std::size_t a = 0; a < m; ++a)
      for (std::size_t b = a + 1; b < m && !deeper; ++b)
        deeper = deepest(contacts_of(group, a, b)) > before[a * m + b] + 2e-3;
    if (deeper) continue;
    for (std::size_t k = 0; k < m; ++k) bodies[members[k]].camera_from_body = group[k].camera_from_body;
  }
}

}  // namespace tribin
