#include "segmentation/consensus.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "segmentation/labelling.hpp"
#include "segmentation/proposals.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

// Nats for two neighbours of different models. Faces ten points wide have a third of theirs beside a rim; less than the
// logarithm of that, because a point's neighbours go together.
constexpr double kEdge = 0.4;
// A model whose points cost less, all told, is sure: noise alone costs 0.5, being unexplained 4.5.
constexpr double kSure = 1.1;

/// What a model costs [nats]: the logarithm of how finely its points know each of its numbers within the range that it
/// could have (some hundred sigmas for places, some tens of its sd for tilts), and of how seldom parts have its type.
Model model_of(const Surface& surface, bool axis_held) {
  constexpr double kTilt = 4, kPlace = 6, kRadius = 5;
  constexpr double kChoice = 1.5;                          // which of the known directions
  constexpr double kSeldom[] = {0.5, 1.0, 3.0, 4.5, 4.0};  // in the order of PrimitiveType: 60, 35, 5, 1 and 2 of 100
  const double axis = axis_held ? kChoice : 2 * kTilt;
  double cost = kSeldom[static_cast<int>(surface.type)];
  switch (surface.type) {
    case PrimitiveType::plane:
      cost += axis + kPlace;
      break;
    case PrimitiveType::cylinder:
      cost += axis + 2 * kPlace + kRadius;
      break;
    case PrimitiveType::cone:
      cost += axis + 2 * kPlace + kRadius + kTilt;
      break;
    case PrimitiveType::sphere:
      cost += 3 * kPlace + kRadius;
      break;
    case PrimitiveType::torus:
      cost += axis + 3 * kPlace + 2 * kRadius;
      break;
  }
  return {surface, cost, axis_held};
}

/// Fits every model to its points again.
void refit(Labelling& l) {
  const Surfels& s = l.surfels;
  const std::vector<Indices> support = l.supports();
  std::vector<Fit> fits(support.size());
  parallel_each(static_cast<int>(support.size()), [&](int k) {
    const auto m = static_cast<std::size_t>(k);
    if (support[m].size() >= 3) fits[m] = fit_any(s, support[m], l.models[m].surface, l.models[m].axis_held);
  });
  for (std::size_t m = 0; m < support.size(); ++m) {
    if (!fits[m].valid) continue;
    double was = 0, is = 0;
    for (std::uint32_t i : support[m]) {
      was += l.misfit[i];
      is += std::min(Labelling::kUnexplained, l.place_cost(i, fits[m].surface));
    }
    if (is < was) l.replace(m, model_of(fits[m].surface, l.models[m].axis_held));
  }
}

void expand_all(Labelling& l) {
  const std::vector<Indices> support = l.supports();
  for (std::size_t m = 0; m < support.size(); ++m)
    if (l.count[m] > 0) expand(l, l.models[m], support[m], static_cast<std::int32_t>(m));
}

/// Pairs of models that touch.
std::set<std::pair<std::int32_t, std::int32_t>> touching(const Labelling& l) {
  const Surfels& s = l.surfels;
  std::set<std::pair<std::int32_t, std::int32_t>> out;
  for (std::uint32_t i = 0; i < s.size(); ++i)
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::int32_t a = l.label[i], b = l.label[s.neighbours[k]];
      if (a >= 0 && b >= 0 && a < b) out.emplace(a, b);
    }
  return out;
}

/// Offers one surface for every two models that touch, and every model's points another type.
void offer_variants(Labelling& l, const Limits& limits, std::span<const Vec3> directions) {
  const Surfels& s = l.surfels;
  struct Offer {
    Surface start, fitted;
    bool axis_held = false;
    Indices support;
    bool valid = false;
  };
  const std::vector<Indices> support = l.supports();
  std::vector<Offer> offers;
  for (const auto& [a, b] : touching(l)) {
    const auto p = static_cast<std::size_t>(a), q = static_cast<std::size_t>(b);
    Indices both = support[p];
    both.insert(both.end(), support[q].begin(), support[q].end());
    offers.push_back({l.models[p].surface, {}, l.models[p].axis_held, both, false});
    offers.push_back({l.models[q].surface, {}, l.models[q].axis_held, std::move(both), false});
  }
  for (std::size_t m = 0; m < support.size(); ++m) {
    if (support[m].size() < 4) continue;
    const Model& model = l.models[m];
    if (model.axis_held) offers.push_back({model.surface, {}, false, support[m], false});
    if (model.surface.type != PrimitiveType::sphere)
      for (const Vec3& d : directions) {
        const double agree = d.dot(model.surface.axis);
        if (std::abs(agree) < std::cos(10 * kDegree) || model.axis_held) continue;
        Surface held = model.surface;
        held.axis = agree > 0 ? d : Vec3(-d);
        offers.push_back({held, {}, true, support[m], false});
      }
    if (model.surface.type == PrimitiveType::sphere || model.surface.type == PrimitiveType::cone)
      for (const Vec3& d : directions) {
        Surface cylinder = model.surface;
        cylinder.type = PrimitiveType::cylinder;
        cylinder.axis = d;
        cylinder.half_angle = 0;
        offers.push_back({cylinder, {}, true, support[m], false});
        if (model.surface.type == PrimitiveType::sphere) offers.push_back({cylinder, {}, false, support[m], false});
      }
    if (model.surface.type != PrimitiveType::plane) {
      Surface plane;
      plane.point = s.position[support[m][0]].cast<double>();
      offers.push_back({plane, {}, false, support[m], false});
    }
    if (model.surface.type == PrimitiveType::cone || model.surface.type == PrimitiveType::cylinder) {
      Surface other = model.surface;
      const bool cone = other.type == PrimitiveType::cone;
      other.type = cone ? PrimitiveType::cylinder : PrimitiveType::cone;
      other.half_angle = 0;
      offers.push_back({other, {}, false, support[m], false});
    }
  }
  parallel_each(static_cast<int>(offers.size()), [&](int k) {
    Offer& o = offers[static_cast<std::size_t>(k)];
    const Fit fit = fit_any(s, o.support, o.start, o.axis_held);
    o.valid = fit.valid && (fit.surface.type == PrimitiveType::plane || fit.surface.radius < limits.max_radius_mm);
    if (fit.valid && fit.surface.type == PrimitiveType::cone && !tapers(fit)) o.valid = false;
    o.fitted = fit.surface;
  });
  for (const Offer& o : offers)
    if (o.valid) expand(l, model_of(o.fitted, o.axis_held), o.support);
}

/// Takes away each model whose points the models beside it explain more cheaply together.
void drop_needless(Labelling& l) {
  const Surfels& s = l.surfels;
  std::vector<std::size_t> order;
  for (std::size_t m = 0; m < l.models.size(); ++m)
    if (l.count[m] > 0) order.push_back(m);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return l.count[a] < l.count[b]; });
  for (std::size_t m : order) {
    if (l.count[m] == 0) continue;
    const double before = l.energy();
    const std::vector<std::int32_t> label = l.label;
    const std::vector<double> misfit = l.misfit;
    const std::vector<std::uint32_t> count = l.count;
    std::vector<std::int32_t> beside;
    for (std::uint32_t i = 0; i < s.size(); ++i) {
      if (label[i] != static_cast<std::int32_t>(m)) continue;
      l.label[i] = -1;
      l.misfit[i] = Labelling::kUnexplained;
      for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k)
        if (label[s.neighbours[k]] >= 0 && label[s.neighbours[k]] != label[i]) beside.push_back(label[s.neighbours[k]]);
    }
    l.count[m] = 0;
    std::sort(beside.begin(), beside.end());
    beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
    // Twice: what they gain may show that they were fitted to a part.
    std::vector<std::pair<std::size_t, Model>> fitted;
    for (int round = 0; round < 2; ++round)
      for (std::int32_t b : beside) {
        Indices from;
        for (std::uint32_t i = 0; i < s.size(); ++i)
          if (l.label[i] == b) from.push_back(i);
        if (from.empty()) continue;
        const auto q = static_cast<std::size_t>(b);
        if (round > 0) {
          const Fit fit = fit_any(s, from, l.models[q].surface, l.models[q].axis_held);
          double was = 0, is = 0;
          for (std::uint32_t i : from) {
            was += l.misfit[i];
            is += std::min(Labelling::kUnexplained, l.place_cost(i, fit.surface));
          }
          if (fit.valid && is < was) {
            fitted.emplace_back(q, l.models[q]);
            l.replace(q, model_of(fit.surface, l.models[q].axis_held));
          }
        }
        expand(l, l.models[q], from, b);
      }
    if (l.energy() < before - 1e-6) continue;
    for (auto was = fitted.rbegin(); was != fitted.rend(); ++was) l.models[was->first] = was->second;
    l.label = label;
    l.misfit = misfit;
    l.count = count;
  }
}

/// Nats a point of each model costs, its share of the model's own cost and of its rim included.
std::vector<double> cost_per_point(const Labelling& l) {
  const Surfels& s = l.surfels;
  std::vector<double> out(l.models.size(), 0.0);
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    if (l.label[i] < 0) continue;
    double& sum = out[static_cast<std::size_t>(l.label[i])];
    sum += l.misfit[i];
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k)
      sum += l.label[s.neighbours[k]] != l.label[i] ? 0.5 * l.edge : 0;
  }
  for (std::size_t m = 0; m < out.size(); ++m)
    if (l.count[m] > 0) out[m] = (out[m] + l.models[m].cost) / l.count[m];
  return out;
}

/// Directions of the models that are sure of theirs, the largest first, each once.
std::vector<Vec3> directions_of(const Labelling& l, const std::vector<double>& cost) {
  constexpr double kSame = 4 * kDegree;
  constexpr std::size_t kMost = 8, kLeast = 30;
  std::vector<std::size_t> order;
  for (std::size_t m = 0; m < l.models.size(); ++m)
    if (l.count[m] >= kLeast && cost[m] < kSure && l.models[m].surface.type != PrimitiveType::sphere)
      order.push_back(m);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return l.count[a] > l.count[b]; });
  std::vector<Vec3> out;
  for (std::size_t m : order) {
    const Vec3& axis = l.models[m].surface.axis;
    const bool known =
        std::any_of(out.begin(), out.end(), [&](const Vec3& d) { return std::abs(d.dot(axis)) > std::cos(kSame); });
    if (!known && out.size() < kMost) out.push_back(axis);
  }
  return out;
}

/// sd about the largest models that together hold a third of the points, in sigmas; of a step of the noise's sizes.
double scatter_of_largest(const Labelling& l) {
  std::vector<Indices> support = l.supports();
  std::stable_sort(support.begin(), support.end(),
                   [](const Indices& a, const Indices& b) { return a.size() > b.size(); });
  std::vector<double> costs;
  double numbers = 0;
  for (const Indices& plane : support) {
    if (plane.empty() || 3 * costs.size() > l.label.size()) break;
    for (std::uint32_t i : plane) costs.push_back(l.misfit[i]);
    numbers += 3;
  }
  if (costs.empty()) return 1;
  const auto half = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::nth_element(costs.begin(), half, costs.end());
  const double n = static_cast<double>(costs.size());
  return std::clamp(1.4826 * std::sqrt(2 * *half * n / std::max(1.0, n - numbers)), 0.7, 1.4);
}

}  // namespace

bool noise_shows(const Scene& scene) {
  // Twenty faces, as a part of medium size has, of 192 points each, the largest window of a surfel: with more points
  // windows grow until they decide, and labelling all takes longer than some seconds.
  if (scene.surfels.size() > 20 * 192) return false;
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
  Surfels out = surfels;
  Indices all(surfels.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  std::vector<float> sorted(out.sigma_mm);
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  // Windows that cross edges tell too much. Planes alone, for noise of every size from theirs down: a small one needs
  // many planes, a large one leaves residuals that a smaller would say in fewer nats. The shortest code is right.
  constexpr int kSteps = 9;       // down to a sixth
  constexpr double kStep = 0.8;   // the scatter about the largest planes corrects half a step
  constexpr int kMostLonger = 3;  // the code is not smooth
  double least = HUGE_VAL, sigma = *middle;
  for (int step = 0, longer = 0; step < kSteps && longer < kMostLonger; ++step) {
    const double tried = *middle * std::pow(kStep, step);
    std::fill(out.sigma_mm.begin(), out.sigma_mm.end(), static_cast<float>(tried));
    Scene scene(out);
    Labelling l(out, kEdge);
    for (const Proposal& p : propose(scene, limits, {}, 1)) expand(l, model_of(p.surface, false), p.support);
    refit(l);
    expand_all(l);
    const auto free = static_cast<std::size_t>(std::count(l.label.begin(), l.label.end(), -1));
    const double code = l.energy() + static_cast<double>(l.label.size() - free) * std::log(tried / *middle);
    ++longer;
    if (code < least) least = code, sigma = tried * scatter_of_largest(l), longer = 0;
  }
  std::fill(out.sigma_mm.begin(), out.sigma_mm.end(), static_cast<float>(sigma));
  return surfels_among(out, all);
}

void explain_by_consensus(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  constexpr int kRounds = 3;             // the third gains a percent
  constexpr double kWorthwhile = 0.003;  // of all that is still to be said
  Labelling l(s, kEdge);
  double before = l.energy();
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> cost = cost_per_point(l);
    for (std::uint32_t i = 0; i < s.size(); ++i)
      scene.label[i] = l.label[i] >= 0 && cost[static_cast<std::size_t>(l.label[i])] < kSure ? 1 : 0;
    std::vector<Vec3> directions = directions_of(l, cost);
    for (const Proposal& p : propose(scene, limits, directions)) expand(l, model_of(p.surface, p.axis_held), p.support);
    refit(l);
    expand_all(l);
    // The planes told the noise roughly; surfaces of every type tell it better.
    const double scatter = scatter_of_largest(l);
    l.precision /= scatter * scatter;
    for (std::size_t m = 0; m < l.models.size(); ++m) l.replace(m, Model(l.models[m]));
    if (directions.empty()) directions = directions_of(l, cost_per_point(l));
    offer_variants(l, limits, directions);
    drop_needless(l);
    refit(l);
    expand_all(l);
    const double now = l.energy();
    if (round > 0 && now > before * (1 - kWorthwhile)) break;
    before = now;
  }
  std::fill(scene.label.begin(), scene.label.end(), 0);
  const std::vector<Indices> support = l.supports();
  for (std::size_t m = 0; m < support.size(); ++m) {
    if (support[m].empty()) continue;
    FoundSurface f;
    f.fit = fit_any(s, support[m], l.models[m].surface, l.models[m].axis_held);
    if (!f.fit.valid) f.fit.surface = l.models[m].surface;
    f.support = support[m];
    const bool bends = f.fit.surface.type != PrimitiveType::plane;
    if (bends && !l.models[m].axis_held) polish(scene, f);
    if (bends) f.arc = arc_of(s, f.support, f.fit.surface);
    take(scene, found, std::move(f));
  }
}

}  // namespace tribin::segmentation_detail
