#include "tribin/paper_method/recognize.hpp"

#include <gtest/gtest.h>

#include "support/posed_scan.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/eval/eval.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin {
namespace {

const std::vector<Part>& alternators() {
  const auto read = [](char name) {
    return compile_part(read_cad(std::string(TRIBIN_SOURCE_DIR) + "/examples/parts/alternator_" + name + ".stl", {}));
  };
  static const std::vector<Part> parts = {read('a'), read('b')};
  return parts;
}

/// Lying on the table, seen from above: the body's side and what stands out of it are in view.
Pose lying(unsigned seed) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(0, 0, 0.7 * seed)) * rotation_from_vector(Vec3(kPi / 2, 0, 0)) *
                  rotation_from_vector(Vec3(0, 0, 0.9 * seed));
  pose.translation() = Vec3(0, 0, 700);
  return pose;
}

Found found_by_paper(const Scan& scan) {
  FinderOptions options;
  options.method = Method::paper;
  return find_parts(scan, alternators(), options);
}

TEST(PaperRecognize, FindsLyingAlternatorsAndSaysWhy) {
  int answered = 0, found = 0, tried = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const Part& part = alternators()[seed % 2];
    const Pose truth = lying(seed);
    const Scan scan = test::posed_scan({{&part.mesh, truth}}, Vec3(0, 0, -1), -800, 0.1, 0.8, seed, 800, 640);
    const Found result = found_by_paper(scan);
    ++tried;
    for (const Instance& instance : result.instances.items) {
      ++answered;
      found +=
          instance.part == part.name &&
          eval::pose_error(eval::model_of(part), instance.camera_from_part, truth).mssd_mm < 0.05 * part.diameter_mm;
      // The evidence: both key cylinders at least, each with the values and limits of what it passed.
      ASSERT_GE(instance.evidence.size(), 2u);
      EXPECT_EQ(instance.evidence[0].type, PrimitiveType::cylinder);
      EXPECT_EQ(instance.evidence[1].type, PrimitiveType::cylinder);
      for (const Evidence& e : instance.evidence) EXPECT_FALSE(e.tests.empty()) << e.primitive;
      for (const TestResult& test : instance.evidence[0].tests) EXPECT_TRUE(test.passed) << test.test;
      EXPECT_GE(instance.score, 0.5);
      EXPECT_LE(instance.score, 1);
    }
    for (const Reason& reason : result.instances.rejected) {
      EXPECT_FALSE(reason.test.empty());
      EXPECT_GT(reason.count, 0);
    }
  }
  // How often it succeeds is measured by `tribin bench`; that it works at all is tested here.
  EXPECT_GE(found, 3);
  EXPECT_LE(answered, tried);  // one object, one answer at most
}

TEST(PaperRecognize, AnEmptyTableIsEmpty) {
  const Found result = found_by_paper(test::posed_scan({}, Vec3(0, 0, -1), -800, 0.1, 0.8, 1, 800, 640));
  EXPECT_TRUE(result.instances.items.empty());
  EXPECT_EQ(result.status, "empty");
}

TEST(PaperRecognize, GivesTheSameBytesOnAnyNumberOfThreads) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const Part& part = alternators()[seed % 2];
    const Scan scan = test::posed_scan({{&part.mesh, lying(seed)}}, Vec3(0, 0, -1), -800, 0.1, 0.8, seed, 800, 640);
    set_thread_count(1);
    const Found one = found_by_paper(scan);
    set_thread_count(2);
    const Found two = found_by_paper(scan);
    set_thread_count(0);
    ASSERT_EQ(one.instances.items.size(), two.instances.items.size());
    for (std::size_t i = 0; i < one.instances.items.size(); ++i) {
      const Instance &a = one.instances.items[i], &b = two.instances.items[i];
      EXPECT_TRUE(a.camera_from_part.matrix() == b.camera_from_part.matrix());
      EXPECT_EQ(a.score, b.score);
    }
    ASSERT_EQ(one.instances.rejected.size(), two.instances.rejected.size());
    for (std::size_t i = 0; i < one.instances.rejected.size(); ++i) {
      EXPECT_EQ(one.instances.rejected[i].test, two.instances.rejected[i].test);
      EXPECT_EQ(one.instances.rejected[i].count, two.instances.rejected[i].count);
      EXPECT_EQ(one.instances.rejected[i].value, two.instances.rejected[i].value);
    }
  }
}

}  // namespace
}  // namespace tribin
