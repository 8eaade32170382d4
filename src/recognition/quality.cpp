#include "tribin/recognition/quality.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "instance_report.hpp"
#include "metrology.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

std::string written(const char* format, auto... values) {
  char text[240];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string reason_of(const Dimension& d) {
  const double off = std::abs(d.measured - d.nominal);
  const char* format = d.is_angle ? "%s %.2f deg measured, %.2f nominal, %.1f sigma, tolerance %.2f"
                                  : "%s %.2f mm measured, %.2f nominal, %.1f sigma, tolerance %.2f";
  const double unit = d.is_angle ? kDegree : 1;
  return written(format, d.name.c_str(), d.measured / unit, d.nominal / unit, off / std::max(d.sigma, 1e-9),
                 d.tolerance / unit);
}

std::string reason_of(const Part& part, const Deviation& d) {
  const std::string on = d.primitive > 0
                             ? std::string(" on ") +
                                   name_of(part.model.primitives[static_cast<std::size_t>(d.primitive - 1)].type) +
                                   " " + std::to_string(d.primitive)
                             : std::string();
  if (d.kind == "missing")
    return written("missing: %.0f mm2%s are seen through, at least %.2f mm deep", d.area_mm2, on.c_str(),
                   std::abs(d.depth_mm));
  return written("%s: %.0f mm2%s lie %.2f mm %s the surface, %.1f sigma", d.kind.c_str(), d.area_mm2, on.c_str(),
                 std::abs(d.depth_mm), d.depth_mm < 0 ? "below" : "above",
                 std::abs(d.depth_mm) / std::max(d.sigma_mm, 1e-9));
}

void decide(const Part& part, bool pose_is_told, Quality& quality) {
  // Of a tenth of what faces the camera, edges aside, nothing is said.
  constexpr double kLeastChecked = 0.1;
  if (!pose_is_told) {
    quality.reasons = {"which of its poses it is in is not told"};
    return;
  }
  for (const Dimension& d : quality.dimensions)
    if (d.deviates) quality.reasons.push_back(reason_of(d));
  for (const Deviation& d : quality.deviations) quality.reasons.push_back(reason_of(part, d));
  if (!quality.reasons.empty()) {
    quality.decision = QualityDecision::deviates;
  } else if (quality.checked_fraction < kLeastChecked) {
    quality.reasons = {written("%.0f %% of its silhouette could be compared, less than %.0f %%",
                               100 * quality.checked_fraction, 100 * kLeastChecked)};
  } else {
    quality.decision = QualityDecision::nominal;
  }
}

/// The 95 % quantile of residuals in sigmas, of pixels that no mirror can reach and of the others; 0 where there are
/// too few to tell. \param both_sides  of the residuals above and of those below the surface, the smaller one: fringes
/// of two surfaces
///                    that add up move one to and fro; a dent or a wider bore lies on one side.
std::array<float, 2> error_tails(const SceneDepth& scene, const PartPixels& pixels, bool both_sides) {
  std::array<std::array<std::vector<float>, 2>, 2> errors;
  const IndexRender& r = pixels.render;
  for (int j = 0; j < r.height; j += 2)
    for (int i = 0; i < r.width; i += 2) {
      const std::size_t k = r.index(i, j);
      const int u = r.u0 + i * pixels.step, v = r.v0 + j * pixels.step;
      if (!pixels.inner[k] || !(scene.z_mm(u, v) > 0) || scene.near_break(u, v)) continue;
      const float e = (scene.z_mm(u, v) - 1 / r.inverse_z[k]) / scene.sigma_mm(u, v);
      // Farther off is another thing.
      if (std::abs(e) < 30) errors[pixels.mirrored[k]][both_sides && e > 0].push_back(std::abs(e));
    }
  constexpr std::size_t kLeast = 100;
  const auto tail = [&](std::vector<float>& e) {
    if (e.size() < kLeast) return 0.0f;
    const auto at = e.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(e.size()));
    std::nth_element(e.begin(), at, e.end());
    return *at;
  };
  std::array<float, 2> out;
  for (std::size_t m = 0; m < 2; ++m)
    out[m] = both_sides ? std::min(tail(errors[m][0]), tail(errors[m][1])) : tail(errors[m][0]);
  return out;
}

/// Are surfaces that could mirror others measured worse than those that cannot? On matt parts they are not, and count
/// as all others do. What holds for two of five parts tells, so that damage to some does not look like shine.
bool mirrors_show(const SceneDepth& scene, std::span<const PartPixels> compared) {
  constexpr std::size_t kSeveral = 3;
  std::array<std::vector<float>, 2> tails;
  for (const PartPixels& pixels : compared) {
    const std::array<float, 2> t = error_tails(scene, pixels, compared.size() < kSeveral);
    for (std::size_t m = 0; m < 2; ++m)
      if (t[m] > 0) tails[m].push_back(t[m]);
  }
  const auto common = [](std::vector<float>& values) {
    if (values.empty()) return 0.0f;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.6 * static_cast<double>(values.size()));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  // 95 % of the noise lie within 1.96. In simulated heaps matt parts stay below 1.06 times that in nine of ten, shiny
  // ones lie at 1.12 and more in five of five.
  return common(tails[1]) > 1.1f * std::max(1.96f, common(tails[0]));
}

}  // namespace

const char* name_of(QualityDecision decision) {
  switch (decision) {
    case QualityDecision::nominal:
      return "nominal";
    case QualityDecision::deviates:
      return "deviates";
    default:
      return "not_checked";
  }
}

void describe_quality(std::span<const Part> parts, const SceneDepth& scene, const SceneFeatures& features,
                      const NoiseProfile& noise, Instances& found) {
  const SystematicVariances systematic = systematic_variances(noise);
  std::vector<Instance*> all;
  for (Instance& instance : found.items) all.push_back(&instance);
  for (Instance& instance : found.uncertain) all.push_back(&instance);
  const auto index_of = [&](const Instance& instance) {
    return static_cast<std::size_t>(
        std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; }) -
        parts.begin());
  };
  std::vector<std::vector<double>> facets(parts.size());
  for (const Instance* instance : all)
    if (auto& errors = facets[index_of(*instance)]; errors.empty()) errors = facet_errors(parts[index_of(*instance)]);
  std::vector<PartPixels> compared(all.size());
  parallel_each(static_cast<int>(all.size()), [&](int k) {
    const Instance& instance = *all[static_cast<std::size_t>(k)];
    compared[static_cast<std::size_t>(k)] = compare_pixels(parts[index_of(instance)], scene, instance);
  });
  const bool shiny = mirrors_show(scene, compared);
  for (PartPixels& pixels : compared) {
    pixels.shiny = shiny;
    if (!shiny) pixels.mirrored.assign(pixels.mirrored.size(), 0);
  }
  parallel_each(static_cast<int>(all.size()), [&](int k) {
    Instance& instance = *all[static_cast<std::size_t>(k)];
    const std::size_t of = index_of(instance);
    const Part& part = parts[of];
    const PartPixels& pixels = compared[static_cast<std::size_t>(k)];
    const std::vector<MeasuredPrimitive> measured =
        measure_primitives(part, facets[of], scene, features, pixels, instance);
    for (const MeasuredPrimitive& m : measured) instance.evidence.push_back(evidence_of(m, pixels, systematic));
    std::stable_sort(instance.evidence.begin(), instance.evidence.end(),
                     [](const Evidence& a, const Evidence& b) { return a.inliers > b.inliers; });
    Quality& quality = instance.quality;
    quality.dimensions = measure_dimensions(measured, systematic);
    quality.deviations = find_deviations(part, scene, pixels, instance, quality.checked_fraction);
    decide(part, k < static_cast<int>(found.items.size()), quality);
  });
}

}  // namespace tribin
