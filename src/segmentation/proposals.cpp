#include "segmentation/proposals.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kReach = 3.0;  // sigmas: beyond, a point is not explained
constexpr int kSamples = 60;    // three of four good points: 0.4 of the triples are good, 0.5 of the pairs
constexpr std::size_t kSizes[] = {16, 48, 144};  // neighbourhoods, in points: from narrow faces to wide arcs
constexpr std::size_t kNarrow[] = {8, 16, 32};   // where the axis is known: walls of holes, narrow strips
constexpr std::size_t kLeastHeld = 5;            // three numbers and two that prove them

/// Numbers that look random and are the same on every machine.
struct Numbers {
  std::uint64_t state;
  std::uint32_t below(std::size_t n) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<std::uint32_t>((state >> 33) % n);
  }
};

double off(const Surfels& s, std::uint32_t i, const Surface& surface) {
  return std::abs(surface.distance(s.position[i].cast<double>())) / s.sigma_mm[i];
}

/// Free points on the surface that hang together through points most of whose free neighbours lie on it: a surface
/// that cuts through others has a string of points, none of them inside.
Indices grow_inside(Scene& scene, const Surface& surface, const Indices& from) {
  const Surfels& s = scene.surfels;
  const std::uint32_t seen = ++scene.tick;
  Indices out;
  const auto consider = [&](std::uint32_t j) {
    if (scene.mark[j] == seen) return;
    scene.mark[j] = seen;
    if (scene.free(j) && off(s, j, surface) <= kReach) out.push_back(j);
  };
  const auto inside = [&](std::uint32_t i) {
    std::uint32_t on = 0, all = 0;
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      if (!scene.free(s.neighbours[k])) continue;
      ++all;
      on += off(s, s.neighbours[k], surface) <= kReach;
    }
    return 2 * on > all;
  };
  for (std::uint32_t i : from)
    if (scene.mark[i] != seen && scene.free(i) && off(s, i, surface) <= kReach && inside(i)) consider(i);
  for (std::size_t at = 0; at < out.size(); ++at)
    if (inside(out[at]))
      for (std::uint32_t k = s.neighbour_begin[out[at]]; k < s.neighbour_begin[out[at] + 1]; ++k)
        consider(s.neighbours[k]);
  return out;
}

/// Fit and growth in turn, from a start to all that lies on its surface.
Proposal settle(Scene& scene, const Surface& start, bool axis_held, const Indices& from, const Limits& limits) {
  const Surfels& s = scene.surfels;
  Proposal p;
  p.surface = start;
  p.axis_held = axis_held;
  const std::size_t least = axis_held ? kLeastHeld : limits.min_surfels;
  Indices support;
  for (std::uint32_t i : from)
    if (off(s, i, start) <= kReach) support.push_back(i);
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    if (support.size() < least) return {};
    const Fit fit = fit_any(s, support, p.surface, axis_held);
    const bool bends = fit.surface.type != PrimitiveType::plane;
    if (!fit.valid || (bends && !(fit.surface.radius < limits.max_radius_mm))) return {};
    if (fit.surface.type == PrimitiveType::cone && round + 1 == kRounds && !tapers(fit)) return {};
    p.surface = fit.surface;
    Indices next = grow_inside(scene, fit.surface, support);
    const bool same = next.size() == support.size();
    support = std::move(next);
    if (same) break;
  }
  if (support.size() < least) return {};
  const int parameters = parameters_of(p.surface.type) - (axis_held ? 2 : 0);
  p.gain = -0.5 * parameters * std::log(static_cast<double>(support.size()));
  for (std::uint32_t i : support) p.gain += 0.5 * std::max(0.0, kReach * kReach - std::pow(off(s, i, p.surface), 2));
  p.support = std::move(support);
  return p;
}

Surface plane_through(const Surfels& s, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Surface out;
  out.point = s.position[a].cast<double>();
  out.axis = (s.position[b].cast<double>() - out.point).cross(s.position[c].cast<double>() - out.point);
  const double length = out.axis.norm();
  if (length > 0) out.axis /= length;
  return out;
}

/// The cylinder or sphere that two points with normals lie on; radius 0 where there is none. \param side  of b's
/// normal, which may be the wrong one.
Surface round_through(const Surfels& s, std::uint32_t a, std::uint32_t b, double side, PrimitiveType type) {
  Surface out;
  out.type = type;
  out.radius = 0;
  Vec3 na = s.normal[a].cast<double>(), nb = side * s.normal[b].cast<double>();
  const Vec3 pa = s.position[a].cast<double>(), pb = s.position[b].cast<double>();
  const Vec3 turn = na - nb;
  if (turn.squaredNorm() < 0.03 || (na + nb).squaredNorm() < 0.03) return out;  // 10 deg: next to parallel
  const double r = (pa - pb).dot(turn) / turn.squaredNorm();
  out.point = 0.5 * (pa - r * na + pb - r * nb);
  out.radius = std::abs(r);
  out.concave = r < 0;
  if (type == PrimitiveType::cylinder) out.axis = na.cross(nb).normalized();
  return out;
}

/// The cylinder along an axis that three points lie on; radius 0 where there is none.
Surface cylinder_along(const Surfels& s, const Vec3& axis, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Surface out;
  out.type = PrimitiveType::cylinder;
  out.radius = 0;
  out.axis = axis;
  const auto across = [&](std::uint32_t i) {
    const Vec3 p = s.position[i].cast<double>() - s.position[a].cast<double>();
    return Vec3(p - axis * axis.dot(p));
  };
  const Vec3 p = across(b), q = across(c);
  const double cross = axis.dot(p.cross(q));
  if (std::abs(cross) < 1e-9 * (p.squaredNorm() + q.squaredNorm())) return out;
  const Vec3 centre = (p.squaredNorm() * q - q.squaredNorm() * p).cross(axis) / (2 * cross);
  out.point = s.position[a].cast<double>() + centre;
  out.radius = centre.norm();
  return out;
}

double worth(const Surfels& s, const Indices& near, const Surface& surface) {
  double sum = 0;
  for (std::uint32_t i : near) {
    const double e = off(s, i, surface) / kReach;  // a sample lies off by several sigmas itself
    sum += std::max(0.0, kReach * kReach - e * e);
  }
  return sum;
}

/// The best of the samples of one type from one neighbourhood, by what they explain of it.
Surface sample(const Surfels& s, const Indices& near, PrimitiveType type, const Limits& limits, Numbers& numbers) {
  Surface best;
  double most = 0;
  Indices known;
  for (std::uint32_t i : near)
    if (s.sigma_normal[i] < 1) known.push_back(i);
  if (near.size() < 4 || (type != PrimitiveType::plane && known.size() < 4)) return best;
  for (int k = 0; k < kSamples; ++k) {
    Surface surface;
    if (type == PrimitiveType::plane) {
      surface = plane_through(s, near[numbers.below(near.size())], near[numbers.below(near.size())],
                              near[numbers.below(near.size())]);
      if (surface.axis.isZero()) continue;
    } else {
      const std::uint32_t a = known[numbers.below(known.size())], b = known[numbers.below(known.size())];
      surface = round_through(s, a, b, k % 2 == 0 ? 1.0 : -1.0, type);
      if (!(surface.radius > 0) || surface.radius > limits.max_radius_mm) continue;
    }
    const double gain = worth(s, near, surface);
    if (gain > most) most = gain, best = surface;
  }
  return best;
}

/// The same along a known axis: a cylinder, or the plane across it. \return radius and axis 0 where there is none.
Surface sample_along(const Surfels& s, const Indices& near, const Vec3& axis, PrimitiveType type, const Limits& limits,
                     Numbers& numbers) {
  Surface best;
  best.axis.setZero();
  double most = 0;
  for (int k = 0; k < kSamples / 3; ++k) {
    Surface surface;
    if (type == PrimitiveType::plane) {
      surface.axis = axis;
      surface.point = s.position[near[numbers.below(near.size())]].cast<double>();
    } else {
      surface = cylinder_along(s, axis, near[numbers.below(near.size())], near[numbers.below(near.size())],
                               near[numbers.below(near.size())]);
      if (!(surface.radius > 0) || surface.radius > limits.max_radius_mm) continue;
    }
    const double gain = worth(s, near, surface);
    if (gain > most) most = gain, best = surface;
  }
  return best;
}

/// The best surface of one type from the neighbourhoods of a seed; cones come from cylinders.
Proposal best_from(Scene& scene, std::uint32_t seed, PrimitiveType type, const Limits& limits) {
  Proposal best;
  Numbers numbers{seed * 7919ull + 1};
  const bool cone = type == PrimitiveType::cone;
  const PrimitiveType start_type = cone ? PrimitiveType::cylinder : type;
  for (std::size_t size : kSizes) {
    const Indices near = nearest_free(scene, seed, size);
    const Surface start = sample(scene.surfels, near, start_type, limits, numbers);
    if (start.type != start_type || start.axis.isZero()) continue;
    Proposal p = settle(scene, start, false, near, limits);
    if (cone && p.gain > 0) {
      Surface tapered = p.surface;
      tapered.type = PrimitiveType::cone;
      p = settle(scene, tapered, false, Indices(p.support), limits);
    }
    if (p.gain > best.gain) best = std::move(p);
    if (near.size() < size) break;
  }
  return best;
}

/// The best narrow plane or cylinder of a seed along one of the directions.
Proposal best_along(Scene& scene, std::uint32_t seed, PrimitiveType type, std::span<const Vec3> directions,
                    const Limits& limits) {
  Proposal best;
  Numbers numbers{seed * 7919ull + 2};
  for (std::size_t size : kNarrow) {
    const Indices near = nearest_free(scene, seed, size);
    if (near.size() < kLeastHeld) break;
    Surface start;
    double most = 0;
    for (const Vec3& axis : directions) {
      const Surface surface = sample_along(scene.surfels, near, axis, type, limits, numbers);
      if (surface.axis.isZero()) continue;
      const double gain = worth(scene.surfels, near, surface);
      if (gain > most) most = gain, start = surface;
    }
    if (!(most > 0)) continue;
    Proposal p = settle(scene, start, true, near, limits);
    if (p.gain > best.gain) best = std::move(p);
    if (near.size() < size) break;
  }
  return best;
}

}  // namespace

Indices nearest_free(Scene& scene, std::uint32_t i, std::size_t most) {
  const Surfels& s = scene.surfels;
  const std::uint32_t seen = ++scene.tick;
  Indices out(1, i);
  scene.mark[i] = seen;
  for (std::size_t at = 0; at < out.size() && out.size() < most; ++at)
    for (std::uint32_t k = s.neighbour_begin[out[at]]; k < s.neighbour_begin[out[at] + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      if (scene.mark[j] == seen || !scene.free(j)) continue;
      scene.mark[j] = seen;
      out.push_back(j);
    }
  if (out.size() > most) out.resize(most);
  return out;
}

Fit fit_any(const Surfels& s, const Indices& support, const Surface& start, bool axis_held) {
  if (start.type != PrimitiveType::plane) {
    FitOptions options;
    options.hold_axis = axis_held;
    options.cone = start.type == PrimitiveType::cone;
    options.max_surfels = 200;
    return fit_round(s, support, start, options);
  }
  if (!axis_held) return fit_plane(s, support);
  Fit fit;
  fit.surface = start;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (std::uint32_t i : support) {
      const double e = off(s, i, fit.surface) / kReach;
      const double weight = 1 / std::pow((1 + e * e) * s.sigma_mm[i], 2);
      sum += weight * s.position[i].cast<double>();
      total += weight;
    }
    fit.surface.point = sum / total;
    fit.covariance(2, 2) = 1 / total;
  }
  fit.valid = true;
  return fit;
}

std::vector<Proposal> propose(Scene& scene, const Limits& limits, std::span<const Vec3> directions,
                              std::size_t free_types, std::size_t most_seeds) {
  Indices seeds;
  for (std::uint32_t i = 0; i < scene.surfels.size(); ++i)
    if (scene.free(i)) seeds.push_back(i);
  const std::size_t stride = 1 + seeds.size() / most_seeds;
  std::size_t count = 0;
  for (std::size_t k = 0; k < seeds.size(); k += stride) seeds[count++] = seeds[k];
  seeds.resize(count);
  // Each seed tries every type; two more along the directions.
  const std::size_t types = directions.empty() ? free_types : free_types + 2;
  std::vector<Proposal> out(seeds.size() * types);
  // In batches: a seed that three proposals of the type hold already would only find them again.
  constexpr std::size_t kBatch = 64;
  constexpr std::uint8_t kOften = 3;
  std::vector<std::uint8_t> held(scene.surfels.size() * types, 0);
  const std::size_t batches = (seeds.size() + kBatch - 1) / kBatch;
  for (std::size_t batch = 0; batch < batches; ++batch) {
    // Every batch is spread over all points: neighbours in the file are often neighbours in space.
    const auto place = [&](std::size_t k) { return (batch + k / types * batches) * types + k % types; };
    const std::size_t in_batch = (seeds.size() - batch + batches - 1) / batches * types;
    parallel_each(static_cast<int>(in_batch), [&](int n) {
      const auto k = static_cast<std::size_t>(n);
      const std::uint32_t seed = seeds[place(k) / types];
      const std::size_t type = k % types;
      if (held[seed * types + type] >= kOften) return;
      Scene own = scene.fork();
      out[place(k)] = type < free_types
                          ? best_from(own, seed, static_cast<PrimitiveType>(type), limits)
                          : best_along(own, seed, static_cast<PrimitiveType>(type - free_types), directions, limits);
    });
    for (std::size_t k = 0; k < in_batch; ++k)
      for (std::uint32_t i : out[place(k)].support) {
        std::uint8_t& often = held[i * types + k % types];
        often = std::min<std::uint8_t>(kOften, static_cast<std::uint8_t>(often + 1));
      }
  }
  std::erase_if(out, [](const Proposal& p) { return !(p.gain > 0); });
  std::stable_sort(out.begin(), out.end(), [](const Proposal& a, const Proposal& b) { return a.gain > b.gain; });
  return out;
}

}  // namespace tribin::segmentation_detail
