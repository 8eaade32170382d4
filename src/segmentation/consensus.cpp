#include "segmentation/consensus.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kReach = 3.0;           // sigmas: beyond, a point is not explained
constexpr std::size_t kMostSeeds = 600;  // a face with 1 % of the points has six of them
constexpr int kProposals = 60;           // three of four good points: 0.4 of the triples are good, 0.5 of the pairs
constexpr std::size_t kSizes[] = {16, 48, 144};  // neighbourhoods, in points: from narrow faces to wide arcs

struct Candidate {
  FoundSurface found;
  double gain = 0;
  std::uint32_t seed = 0;
  PrimitiveType type = PrimitiveType::plane;
};

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

/// The free points nearest to i along the neighbours, i first.
Indices around(Scene& scene, std::uint32_t i, std::size_t most) {
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

/// Free points on the surface that hang together through points most of whose neighbours lie on it: a surface that
/// cuts through others has a string of points, none of them inside.
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
    std::uint32_t on = 0;
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k)
      on += off(s, s.neighbours[k], surface) <= kReach;
    return 2 * on > s.neighbour_begin[i + 1] - s.neighbour_begin[i];
  };
  for (std::uint32_t i : from)
    if (scene.mark[i] != seen && scene.free(i) && off(s, i, surface) <= kReach && inside(i)) consider(i);
  for (std::size_t at = 0; at < out.size(); ++at)
    if (inside(out[at]))
      for (std::uint32_t k = s.neighbour_begin[out[at]]; k < s.neighbour_begin[out[at] + 1]; ++k)
        consider(s.neighbours[k]);
  return out;
}

/// What a surface saves, in nats: each point against being unexplained, less the parameters' price.
double gain_of(const Surfels& s, const Indices& support, const Surface& surface) {
  double sum = 0;
  for (std::uint32_t i : support) {
    const double e = off(s, i, surface);
    sum += 0.5 * std::max(0.0, kReach * kReach - e * e);
  }
  const double n = std::max<double>(2, static_cast<double>(support.size()));
  // A richer type is called so where it is proven by 3 sigma: many bands of a cylinder are nearly those of a sphere.
  constexpr double kProof = 0.5 * 3 * 3;
  constexpr int kRichness[] = {0, 1, 2, 2, 2};  // in the order of PrimitiveType
  return sum - 0.5 * parameters_of(surface.type) * std::log(n) - kProof * kRichness[static_cast<int>(surface.type)];
}

Fit fit_any(const Surfels& s, const Indices& support, const Surface& surface) {
  if (surface.type == PrimitiveType::plane) return fit_plane(s, support);
  FitOptions options;
  options.cone = surface.type == PrimitiveType::cone;
  options.max_surfels = 200;
  return fit_round(s, support, surface, options);
}

/// Fit and growth in turn, from a proposal to all that lies on its surface.
Candidate settle(Scene& scene, const Surface& start, const Indices& from, const Limits& limits) {
  const Surfels& s = scene.surfels;
  Candidate c;
  c.found.fit.surface = start;
  Indices support;
  for (std::uint32_t i : from)
    if (off(s, i, start) <= kReach) support.push_back(i);
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    if (support.size() < limits.min_surfels) return {};
    const Fit fit = fit_any(s, support, c.found.fit.surface);
    const bool round_one = fit.surface.type != PrimitiveType::plane;
    if (!fit.valid || (round_one && !(fit.surface.radius < limits.max_radius_mm))) return {};
    c.found.fit = fit;
    Indices next = grow_inside(scene, fit.surface, support);
    const bool same = next.size() == support.size();
    support = std::move(next);
    if (same) break;
  }
  if (support.size() < limits.min_surfels) return {};
  c.gain = gain_of(s, support, c.found.fit.surface);
  c.found.support = std::move(support);
  return c;
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

/// The best of the proposals of one type from one neighbourhood, by what they explain of it.
Surface propose(const Surfels& s, const Indices& near, PrimitiveType type, const Limits& limits, Numbers& numbers) {
  Surface best;
  double most = 0;
  Indices known;
  for (std::uint32_t i : near)
    if (s.sigma_normal[i] < 1) known.push_back(i);
  if (near.size() < 4 || known.size() < 4) return best;
  for (int k = 0; k < kProposals; ++k) {
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
    double gain = 0;
    for (std::uint32_t i : near) {
      const double e = off(s, i, surface) / kReach;  // a proposal lies off by several sigmas itself
      gain += std::max(0.0, kReach * kReach - e * e);
    }
    if (gain > most) most = gain, best = surface;
  }
  return best;
}

/// The best surface of one type from the neighbourhoods of a seed; cones come from cylinders.
Candidate best_from(Scene& scene, std::uint32_t seed, PrimitiveType type, const Limits& limits) {
  Candidate best;
  Numbers numbers{seed * 7919ull + 1};
  const bool cone = type == PrimitiveType::cone;
  const PrimitiveType start_type = cone ? PrimitiveType::cylinder : type;
  for (std::size_t size : kSizes) {
    const Indices near = around(scene, seed, size);
    const Surface start = propose(scene.surfels, near, start_type, limits, numbers);
    if (start.type != start_type || start.axis.isZero()) continue;
    Candidate c = settle(scene, start, near, limits);
    if (cone && c.gain > 0) {
      Surface tapered = c.found.fit.surface;
      tapered.type = PrimitiveType::cone;
      c = settle(scene, tapered, Indices(c.found.support), limits);
      if (c.gain > 0 && !tapers(c.found.fit)) c = {};
    }
    if (c.gain > best.gain) best = std::move(c);
    if (near.size() < size) break;
  }
  best.seed = seed;
  best.type = type;
  return best;
}

bool untouched(const Scene& scene, const Candidate& c) {
  return std::all_of(c.found.support.begin(), c.found.support.end(), [&](std::uint32_t i) { return scene.free(i); });
}

/// Whether up to three other candidates say the same points better: two faces under one cone, a plane and a fillet.
bool said_better(const Surfels& s, const Candidate& c, const std::vector<Candidate>& others,
                 std::vector<std::uint8_t>& inside, std::vector<double>& squares) {
  constexpr int kMostOthers = 3;
  const auto saves = [&](std::uint32_t i, double e2) { return 0.5 * std::max(0.0, squares[i] - e2); };
  for (std::uint32_t i : c.found.support) inside[i] = 1, squares[i] = kReach * kReach;
  double together = 0;
  for (int k = 0; k < kMostOthers && together <= c.gain; ++k) {
    const Candidate* best = nullptr;
    double most = 0;
    for (const Candidate& other : others) {
      if (&other == &c || !(other.gain > 0)) continue;
      double saved = 0, covered = 2;
      for (std::uint32_t i : other.found.support)
        if (inside[i]) saved += saves(i, std::pow(off(s, i, other.found.fit.surface), 2)), ++covered;
      saved -= 0.5 * parameters_of(other.found.fit.surface.type) * std::log(covered);
      if (saved > most) most = saved, best = &other;
    }
    if (best == nullptr) break;
    together += most;
    for (std::uint32_t i : best->found.support)
      if (inside[i]) squares[i] = std::min(squares[i], std::pow(off(s, i, best->found.fit.surface), 2));
    if (k == 0 && together > c.gain) together = 0;  // one alone is the same surface again, found from another seed
  }
  for (std::uint32_t i : c.found.support) inside[i] = 0;
  return together > c.gain;
}

}  // namespace

bool noise_shows(const Scene& scene) {
  // Fifteen faces, as many as simple parts have, of 192 points each, the largest window of a surfel: with more points
  // windows grow until they decide.
  if (scene.surfels.size() > 15 * 192) return false;
  std::vector<float> share;
  for (std::uint32_t i = 0; i < scene.surfels.size(); ++i)
    if (scene.surfels.area_mm2[i] > 0)
      share.push_back(scene.surfels.sigma_mm[i] / std::sqrt(scene.surfels.area_mm2[i]));
  if (share.empty()) return false;
  const auto middle = share.begin() + static_cast<std::ptrdiff_t>(share.size() / 2);
  std::nth_element(share.begin(), middle, share.end());
  // Ten times what sampling hides: a slope over three points is then known to 1 deg at best.
  return *middle > 0.02f;
}

Surfels with_common_noise(const Surfels& surfels, const Limits& limits) {
  constexpr std::size_t kSeeds = 300;
  Surfels out = surfels;
  std::vector<float> sorted(out.sigma_mm);
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (float& sigma : out.sigma_mm) sigma = std::min(sigma, *middle);
  const Scene scene(out);
  const std::size_t stride = 1 + out.size() / kSeeds;
  std::vector<double> sizes((out.size() + stride - 1) / stride, 0.0);
  parallel_each(static_cast<int>(sizes.size()), [&](int k) {
    Scene own = scene.fork();
    const auto seed = static_cast<std::uint32_t>(static_cast<std::size_t>(k) * stride);
    Numbers numbers{seed * 7919ull + 1};
    const Indices near = around(own, seed, kSizes[1]);
    const Surface start = propose(out, near, PrimitiveType::plane, limits, numbers);
    const Candidate c = settle(own, start, near, limits);
    if (c.found.support.size() < kSizes[0]) return;
    std::vector<double> residuals;
    for (std::uint32_t i : c.found.support) residuals.push_back(off(out, i, c.found.fit.surface));
    const auto half = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), half, residuals.end());
    const double n = static_cast<double>(residuals.size());
    sizes[static_cast<std::size_t>(k)] = 1.4826 * *half * std::sqrt(n / (n - 3));
  });
  std::erase(sizes, 0.0);
  if (sizes.size() < 10) return out;  // hardly a plane anywhere: the windows know better
  // The lower third lies on planes, the rest may bend.
  const auto low = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 3);
  std::nth_element(sizes.begin(), low, sizes.end());
  for (float& sigma : out.sigma_mm) sigma *= static_cast<float>(std::min(1.0, *low));
  return out;
}

void explain_by_consensus(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found) {
  const std::size_t stride = 1 + scene.surfels.size() / kMostSeeds;
  // Each seed tries all types, so that what a richer one explains can be held against several of the simplest.
  constexpr std::size_t kTypes = 4;
  std::vector<Candidate> candidates((scene.surfels.size() + stride - 1) / stride * kTypes);
  // In batches: a seed that three candidates of the type hold already would only find them again.
  constexpr std::size_t kBatch = 64;
  constexpr std::uint8_t kOften = 3;
  std::vector<std::uint8_t> held(scene.surfels.size() * kTypes, 0);
  const std::size_t seeds = candidates.size() / kTypes;
  const std::size_t batches = (seeds + kBatch - 1) / kBatch;
  for (std::size_t batch = 0; batch < batches; ++batch) {
    // Every batch is spread over all points: neighbours in the file are often neighbours in space.
    const auto place = [&](std::size_t k) { return (batch + k / kTypes * batches) * kTypes + k % kTypes; };
    const std::size_t in_batch = (seeds - batch + batches - 1) / batches * kTypes;
    parallel_each(static_cast<int>(in_batch), [&](int n) {
      const auto k = static_cast<std::size_t>(n);
      const std::size_t seed = place(k) / kTypes * stride;
      if (held[seed * kTypes + k % kTypes] >= kOften) return;
      Scene own = scene.fork();
      candidates[place(k)] =
          best_from(own, static_cast<std::uint32_t>(seed), static_cast<PrimitiveType>(k % kTypes), limits);
    });
    for (std::size_t k = 0; k < in_batch; ++k)
      for (std::uint32_t i : candidates[place(k)].found.support) {
        std::uint8_t& count = held[i * kTypes + k % kTypes];
        count = std::min<std::uint8_t>(kOften, static_cast<std::uint8_t>(count + 1));
      }
  }
  // The best first; what has lost points to it since is proposed again.
  const auto less = [&](std::size_t a, std::size_t b) {
    return candidates[a].gain != candidates[b].gain ? candidates[a].gain < candidates[b].gain : a > b;
  };
  std::priority_queue<std::size_t, std::vector<std::size_t>, decltype(less)> queue(less);
  for (std::size_t k = 0; k < candidates.size(); ++k)
    if (candidates[k].gain > 0) queue.push(k);
  std::vector<std::uint8_t> inside(scene.surfels.size(), 0);
  std::vector<double> squares(scene.surfels.size(), 0.0);
  while (!queue.empty()) {
    const std::size_t k = queue.top();
    queue.pop();
    Candidate& c = candidates[k];
    if (!untouched(scene, c)) {
      if (!scene.free(c.seed)) {
        c = {};
        continue;
      }
      c = best_from(scene, c.seed, c.type, limits);
      if (c.gain > 0) queue.push(k);
      continue;
    }
    const bool round_one = c.found.fit.surface.type != PrimitiveType::plane;
    if (round_one && said_better(scene.surfels, c, candidates, inside, squares)) {
      c = {};
      continue;
    }
    c.gain = 0;  // no longer an alternative
    if (round_one) c.found.arc = arc_of(scene.surfels, c.found.support, c.found.fit.surface);
    take(scene, found, std::move(c.found));
  }
}

}  // namespace tribin::segmentation_detail
