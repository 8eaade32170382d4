// Cylinders, cones and spheres that occlude one another, at several noises and correlations with one setting: recall,
// false ones, and errors in units of the Cramer-Rao bound of the very pixels.
// usage: campaign_primitives [SCENES a level = 3] [miss]     "miss" lists what was not found and what was false

#include "tribin/segmentation/primitives.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "support/primitive_scene.hpp"

namespace {

using namespace tribin;
using namespace tribin::test;

struct Tally {
  int large = 0, large_found = 0;  ///< at least 3000 visible pixels
  int all = 0, all_found = 0;      ///< at least 1500
  int given = 0, false_ones = 0, pieces = 0;
  std::vector<double> axis, place;  ///< errors over their bounds

  void add(const Tally& t) {
    large += t.large, large_found += t.large_found, all += t.all, all_found += t.all_found;
    given += t.given, false_ones += t.false_ones, pieces += t.pieces;
    axis.insert(axis.end(), t.axis.begin(), t.axis.end());
    place.insert(place.end(), t.place.begin(), t.place.end());
  }
};

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v * v;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

Tally judge(const PrimitiveScene& scene, const PrimitiveSceneOptions& options, bool list) {
  Tally tally;
  SegmentationOptions quick;
  quick.boundaries = false;
  const Primitives found = segment(surfels_from_scan(scene.scan), quick);
  std::vector<int> owner(found.items.size(), -1);
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    const std::size_t seen = scene.visible[i].size();
    if (seen < 50) continue;
    const Bound bound = cramer_rao_bound(body, scene.visible[i], options.sigma_mm, options.correlation_px);
    const Primitive* best = nullptr;
    Difference off;
    for (std::size_t k = 0; k < found.items.size(); ++k) {
      const Primitive& p = found.items[k];
      const std::optional<Difference> d = difference(p, body, bound.center);
      if (!d) continue;
      owner[k] = static_cast<int>(i);
      if (best) ++tally.pieces;
      if (!best || p.points > best->points) best = &p, off = *d;
    }
    if (seen < 1500) continue;
    ++tally.all;
    tally.all_found += best != nullptr;
    tally.large += seen >= 3000;
    tally.large_found += seen >= 3000 && best != nullptr;
    if (best) {
      if (bound.axis > 0) tally.axis.push_back(off.axis / bound.axis);
      tally.place.push_back(off.place / bound.place);
      if (list && (off.place > 4 * bound.place || off.axis > 4 * bound.axis + 1e-9 * kDegree))
        std::printf(
            "    poor %s %zu R %.2f ha %.1f seen %zu got %d: axis %.1f place %.1f bounds, arc %.0f deg rms %.3f\n",
            name_of(body.type), i, body.radius, body.half_angle / kDegree, seen, best->points,
            bound.axis > 0 ? off.axis / bound.axis : 0, off.place / bound.place, best->arc / kDegree, best->rms_mm);
    } else if (list) {
      std::printf("    missed %s %zu: R %.2f, %.1f long, half angle %.1f deg, %zu px about (%.0f, %.0f, %.0f)\n",
                  name_of(body.type), i, body.radius, 2 * body.half_length, body.half_angle / kDegree, seen,
                  bound.center.x(), bound.center.y(), bound.center.z());
    }
  }
  for (std::size_t k = 0; k < found.items.size(); ++k) {
    const Primitive& p = found.items[k];
    if (p.type == PrimitiveType::plane) continue;
    ++tally.given;
    tally.false_ones += owner[k] < 0;
    if (!list || owner[k] >= 0) continue;
    std::printf("    false %s: R %.2f, half angle %.1f deg, arc %.0f deg, %d px, rms %.3f %s at (%.1f, %.1f, %.1f)\n",
                name_of(p.type), p.radius_mm, p.half_angle / kDegree, p.arc / kDegree, p.points, p.rms_mm,
                p.concave ? "concave" : "", p.point.x(), p.point.y(), p.point.z());
  }
  return tally;
}

void print(const char* name, const Tally& t) {
  std::printf(
      "%-28s %4d/%4d %5.1f %%  %4d/%4d %5.1f %%  false %2d of %4d  pieces %2d  axis %.2f (%.2f)  place %.2f (%.2f)\n",
      name, t.large_found, t.large, 100.0 * t.large_found / std::max(1, t.large), t.all_found, t.all,
      100.0 * t.all_found / std::max(1, t.all), t.false_ones, t.given, t.pieces, quantile(t.axis, 0.68), rms(t.axis),
      quantile(t.place, 0.68), rms(t.place));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int scenes = argc > 1 ? std::atoi(argv[1]) : 3;
  const bool list = argc > 2 && std::strcmp(argv[2], "miss") == 0;
  struct Mix {
    const char* name;
    int cylinders, cones, spheres;
  };
  std::printf("Errors over their bound: 68 %% quantile (rms).            >= 3000 px         >= 1500 px\n");
  for (const Mix& mix :
       {Mix{"40 cylinders", 40, 0, 0}, Mix{"14 cylinders", 14, 0, 0}, Mix{"12 cones, 12 spheres", 0, 12, 12}}) {
    Tally total;
    for (double sigma : {0.05, 0.1, 0.2})
      for (double correlation : {0.0, 0.7, 1.5}) {
        PrimitiveSceneOptions options;
        options.sigma_mm = sigma;
        options.correlation_px = correlation;
        options.cylinders = mix.cylinders;
        options.cones = mix.cones;
        options.spheres = mix.spheres;
        Tally level;
        for (int seed = 1; seed <= scenes; ++seed)
          level.add(judge(primitive_scene(options, static_cast<unsigned>(seed)), options, list));
        char name[64];
        std::snprintf(name, sizeof name, "%s %.2f %.1f", mix.name, sigma, correlation);
        print(name, level);
        total.add(level);
      }
    print(mix.name, total);
  }
  return 0;
}
