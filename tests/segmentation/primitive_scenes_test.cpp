// The campaign `primitives` in small: bodies that occlude one another, one setting for every noise.

#include <gtest/gtest.h>

#include <cmath>

#include "support/primitive_scene.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

using namespace test;

/// Finds every body that shows 1500 px, gives out nothing else, and no error is far beyond what the pixels allow.
void check(const PrimitiveSceneOptions& options, unsigned seed) {
  const PrimitiveScene scene = primitive_scene(options, seed);
  const Primitives found = segment(surfels_from_scan(scene.scan));
  std::vector<bool> right(found.items.size(), false);
  double axis = 0, place = 0;
  int axes = 0, places = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    SCOPED_TRACE(i);
    if (scene.visible[i].size() < 100) continue;
    const Bound bound = cramer_rao_bound(scene.bodies[i], scene.visible[i], options.sigma_mm, options.correlation_px);
    bool any = false;
    for (std::size_t k = 0; k < found.items.size(); ++k) {
      const std::optional<Difference> d = difference(found.items[k], scene.bodies[i], bound.center);
      if (!d) continue;
      right[k] = true;
      if (any || scene.visible[i].size() < 1500) continue;
      any = true;
      if (bound.axis > 0) axis += std::pow(d->axis / bound.axis, 2), ++axes;
      place += std::pow(d->place / bound.place, 2), ++places;
    }
    EXPECT_TRUE(any || scene.visible[i].size() < 1500);
  }
  for (std::size_t k = 0; k < found.items.size(); ++k)
    EXPECT_TRUE(right[k] || found.items[k].type == PrimitiveType::plane) << name_of(found.items[k].type);
  ASSERT_GT(places, 0);
  // rms over some seven bodies: its own scatter is a quarter.
  if (axes > 0) {
    EXPECT_LT(std::sqrt(axis / axes), 2.0);
  }
  EXPECT_LT(std::sqrt(place / places), 2.0);
}

/// The same kind of scene at little and much noise, white and correlated.
void check_all_noises(PrimitiveSceneOptions options, unsigned seed) {
  options.width = 720;
  options.height = 480;
  for (double sigma : {0.05, 0.2})
    for (double correlation : {0.0, 1.5}) {
      SCOPED_TRACE(seed);
      options.sigma_mm = sigma;
      options.correlation_px = correlation;
      check(options, seed++);
    }
}

TEST(PrimitiveScenes, CylindersAtTheirBound) {
  PrimitiveSceneOptions options;
  options.cylinders = 8;
  check_all_noises(options, 1);
}

TEST(PrimitiveScenes, ConesAndSpheresAtTheirBound) {
  PrimitiveSceneOptions options;
  options.cylinders = 0;
  options.cones = options.spheres = 5;
  check_all_noises(options, 11);
}

}  // namespace
}  // namespace tribin
