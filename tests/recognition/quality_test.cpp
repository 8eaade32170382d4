#include <gtest/gtest.h>

#include "part/shapes.hpp"
#include "support/damage.hpp"
#include "support/near_symmetric.hpp"
#include "support/posed_scan.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin {
namespace {

Mesh alternator(char name) {
  return read_cad(std::string(TRIBIN_SOURCE_DIR) + "/examples/parts/alternator_" + name + ".stl", {});
}

Mesh shaft(double middle_radius) {
  return test::turned({{10, 0}, {10, 25}, {middle_radius, 25}, {middle_radius, 65}, {14, 65}, {14, 90}}, 90);
}

Mesh block() { return test::box(80, 60, 40); }

Mesh flange(double bore) { return test::plate_with_hole(test::rectangle(45, 35), 30, {8, 5}, bore, 96); }

Scan scan_of(const Mesh& mesh, const Pose& truth, unsigned seed) {
  return test::posed_scan({{&mesh, truth}}, Vec3(0, 0, -1), -900, 0.08, 0.8, seed, 800, 640);
}

/// A pose in which a direction of the part looks at the camera, 15 to 40 deg aslant, turned by chance about the view.
Pose facing(const Vec3& outward, double depth, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double slant = (15 + 25 * uniform(random)) * kDegree, about = 2 * kPi * uniform(random);
  const Eigen::Vector3d to(std::sin(slant) * std::cos(about), std::sin(slant) * std::sin(about), -std::cos(slant));
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(2 * kPi * uniform(random), Eigen::Vector3d::UnitZ()) *
                  Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(outward), to).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(5, -8, depth);
  return pose;
}

/// What is given out for a scan of `seen` where `drawn` is offered: a good answer of a part that is not as drawn is the
/// failure that these tests look for.
std::vector<Instance> answers(const Mesh& seen, const Part& drawn, const Pose& truth, unsigned seed) {
  const Scan scan = scan_of(seen, truth, seed);
  return find_parts(scan, std::span(&drawn, 1)).instances.items;
}

std::string joined(const Quality& quality) {
  std::string out;
  for (const std::string& reason : quality.reasons) out += reason + "\n";
  return out;
}

TEST(Quality, GoodPartsAreNominal) {
  const Mesh meshes[] = {alternator('a'), shaft(18), block(), flange(14), test::hexagon_with_boss()};
  int compared = 0;
  for (const Mesh& mesh : meshes) {
    const Part part = compile_part(mesh);
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(part.name + " " + std::to_string(seed));
      for (const Instance& i : answers(mesh, part, test::random_pose(650, seed), seed)) {
        EXPECT_NE(i.quality.decision, QualityDecision::deviates) << joined(i.quality);
        compared += static_cast<int>(i.quality.dimensions.size());
        for (const Dimension& d : i.quality.dimensions) EXPECT_LT(std::abs(d.measured - d.nominal), 4.5 * d.sigma);
      }
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Quality, ADentIsFoundWhereItIs) {
  struct Case {
    Mesh mesh;
    Vec3 at, outward;
    double radius, depth;
  };
  // Some 5 % of the surface each.
  const Case cases[] = {{block(), {45, 28, 40}, {0, 0, 1}, 16, 1.5},
                        {flange(14), {-25, -5, 30}, {0, 0, 1}, 14, 2},
                        {test::box(120, 90, 50), {60, 0, 25}, {0, -1, 0}, 20, 1}};
  for (const Case& c : cases) {
    const Part part = compile_part(c.mesh);
    const Mesh dented = test::with_dent(c.mesh, c.at, c.outward, c.radius, c.depth);
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(seed);
      const auto found = answers(dented, part, facing(c.outward, 650, seed), seed);
      ASSERT_EQ(found.size(), 1u);
      const Quality& quality = found[0].quality;
      EXPECT_EQ(quality.decision, QualityDecision::deviates);
      ASSERT_FALSE(quality.deviations.empty());
      const Deviation& d = quality.deviations[0];
      EXPECT_EQ(d.kind, "dent");
      // Where it is, to within the part's symmetries: how far below the surface, and how large.
      EXPECT_LT(d.depth_mm, -0.3 * c.depth);
      EXPECT_GT(d.depth_mm, -1.1 * c.depth);
      EXPECT_GT(d.area_mm2, 0.3 * kPi * c.radius * c.radius);
      EXPECT_LT(d.area_mm2, 1.3 * kPi * c.radius * c.radius);
      if (part.symmetry.discrete.size() == 1 && part.self_similar.empty()) {
        EXPECT_LT((d.at_part_mm - c.at).norm(), 4);
      }
    }
  }
}

TEST(Quality, AnotherRadiusIsNamed) {
  const Part part = compile_part(shaft(18));
  for (const double radius : {17.3, 18.7})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(std::to_string(radius) + " " + std::to_string(seed));
      for (const Instance& i : answers(shaft(radius), part, facing(Vec3(1, 0, 0), 600, seed), seed)) {
        EXPECT_EQ(i.quality.decision, QualityDecision::deviates);
        bool named = false;
        for (const Dimension& d : i.quality.dimensions)
          named |= d.kind == "radius" && d.deviates && d.nominal == 18.0 && std::abs(d.measured - radius) < 5 * d.sigma;
        EXPECT_TRUE(named) << joined(i.quality);
      }
    }
}

TEST(Quality, AnotherBoreIsTold) {
  const Part part = compile_part(flange(14));
  int told = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    for (const Instance& i : answers(flange(15), part, facing(Vec3(0, 0, 1), 500, seed), seed)) {
      // Where its wall is seen: at 15 deg of slant a narrow strip of it.
      const bool seen = std::any_of(i.evidence.begin(), i.evidence.end(), [](const Evidence& e) {
        return e.type == PrimitiveType::cylinder && e.radius_measured_mm;
      });
      told += seen;
      if (seen) {
        EXPECT_EQ(i.quality.decision, QualityDecision::deviates);
      }
    }
  }
  EXPECT_GE(told, 4);
}

TEST(Quality, ABrokenEarIsNoGoodPart) {
  // An angle with a leg that is broken off 12 mm short of its end.
  const Mesh whole = test::prism({{45, -5}, {45, 10}, {10, 10}, {5, 50}, {-12, 50}, {-12, -8}, {30, -8}}, 30);
  const Part part = compile_part(whole);
  const Mesh broken = test::broken_off(whole, Vec3(0, 1, 0), 38);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    for (const Instance& i : answers(broken, part, facing(Vec3(0, 0, seed % 2 ? 1 : -1), 600, seed), seed))
      EXPECT_EQ(i.quality.decision, QualityDecision::deviates);
  }
}

TEST(Quality, TheOtherAlternatorIsNotTakenForAGoodOne) {
  const Part a = compile_part(alternator('a'));
  const Mesh b = alternator('b');
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    for (const Instance& i : answers(b, a, test::random_pose(700, seed), seed))
      EXPECT_NE(i.quality.decision, QualityDecision::nominal);
  }
}

}  // namespace
}  // namespace tribin
