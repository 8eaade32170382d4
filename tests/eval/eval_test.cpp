#include "tribin/eval/eval.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tribin::eval {
namespace {

Pose random_pose(std::mt19937& random) {
  std::normal_distribution<double> gauss;
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(gauss(random), gauss(random), gauss(random)));
  pose.translation() = Vec3(100 * gauss(random), 100 * gauss(random), 800);
  return pose;
}

/// A square prism of 20 x 20 x 50 about z, as corners.
Model prism() {
  Model model;
  model.name = "prism";
  for (int i = 0; i < 8; ++i)
    model.vertices.push_back({i & 1 ? 10.f : -10.f, i & 2 ? 10.f : -10.f, i & 4 ? 50.f : 0.f});
  model.diameter_mm = std::sqrt(400.0 + 400 + 2500);
  model.box_center = Vec3(0, 0, 25);
  for (int k = 0; k < 4; ++k) {
    Pose turn = Pose::Identity();
    turn.linear() = rotation_from_vector(Vec3(0, 0, k * 90 * kDegree));
    model.symmetry.discrete.push_back(turn);
  }
  return model;
}

TEST(PoseError, IsNothingForEverySymmetricPose) {
  const Model model = prism();
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const Pose truth = random_pose(random);
    for (const Pose& s : model.symmetry.discrete) {
      const PoseError error = pose_error(model, truth * s, truth);
      EXPECT_LT(error.mssd_mm, 1e-9);
      EXPECT_LT(error.translation_mm, 1e-9);
      EXPECT_LT(error.rotation, 1e-7);
    }
  }
}

TEST(PoseError, ReturnsTheMotionThatWasApplied) {
  const Model model = prism();
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> gauss;
    const Pose truth = random_pose(random);
    const Vec3 shift(gauss(random), gauss(random), gauss(random)),
        turn = 0.01 * Vec3(gauss(random), gauss(random), gauss(random));
    // Turn about the box's centre, then shift.
    const Vec3 center = truth * model.box_center;
    Pose answer = truth;
    answer.linear() = rotation_from_vector(turn) * truth.linear();
    answer.translation() = center + shift - answer.linear() * model.box_center;
    const PoseError error = pose_error(model, answer * model.symmetry.discrete[seed % 4], truth);
    EXPECT_NEAR((error.translation_axes_mm - shift).norm(), 0, 1e-9);
    EXPECT_NEAR((error.rotation_axes - turn).norm(), 0, 1e-9);
    EXPECT_GE(error.mssd_mm, error.translation_mm - 1e-9) << "some vertex moves at least as far as the centre";
  }
}

TEST(PoseError, ForgetsTheTurnAboutAContinuousAxis) {
  Model model = prism();
  model.symmetry.discrete.resize(1);
  model.symmetry.continuous = {{Vec3::UnitZ(), Vec3(0, 0, 7)}};
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const Pose truth = random_pose(random);
    Pose turn = Pose::Identity();
    turn.linear() = rotation_from_vector(Vec3(0, 0, 0.37 * seed));
    EXPECT_LT(pose_error(model, truth * turn, truth).mssd_mm, 1e-6);
  }
}

Instance answer_at(const std::string& part, const Pose& pose, double score) {
  Instance instance;
  instance.part = part;
  instance.score = score;
  instance.camera_from_part = pose;
  return instance;
}

TEST(Judge, CountsDuplicatesWrongClassesAndWrongPlacesAsFalse) {
  Model other = prism();
  other.name = "other";
  const std::vector<Model> models = {prism(), other};
  std::mt19937 random(3);
  const Pose pose = random_pose(random);
  Pose far = pose;
  far.translation().x() += 30;
  const std::vector<Truth> truths = {{"prism", pose, 0.9}};
  const std::vector<Instance> answers = {answer_at("prism", pose, 0.5), answer_at("prism", pose, 0.9),
                                         answer_at("other", pose, 0.8), answer_at("prism", far, 0.7)};
  const Judgement judged = judge(answers, truths, models);
  ASSERT_EQ(judged.found.size(), 1u);
  EXPECT_EQ(judged.found[0].answer, 1) << "the best score is matched first";
  EXPECT_EQ(judged.false_answers, (std::vector<int>{2, 3, 0}));
  EXPECT_EQ(judged.asked, 1);
}

TEST(Judge, NeitherAsksForNorBlamesWhatShowsTooLittle) {
  const std::vector<Model> models = {prism()};
  std::mt19937 random(4);
  const Pose seen = random_pose(random), hidden = random_pose(random);
  const std::vector<Truth> truths = {{"prism", seen, 0.9}, {"prism", hidden, 0.1}};
  const Judgement judged = judge(std::vector<Instance>{answer_at("prism", hidden, 0.9)}, truths, models, 0.3);
  EXPECT_TRUE(judged.found.empty());
  EXPECT_TRUE(judged.false_answers.empty());
  EXPECT_EQ(judged.asked, 1);
  EXPECT_EQ(judged.missed, std::vector<int>{0});
}

TEST(Share, IsWilsonsInterval) {
  const Share all = share_of(80, 80), half = share_of(5, 10);
  EXPECT_NEAR(all.low, 0.9542, 1e-3);
  EXPECT_NEAR(all.high, 1, 1e-12);
  EXPECT_NEAR(half.low, 0.2366, 1e-3);
  EXPECT_NEAR(half.high, 0.7634, 1e-3);
}

TEST(Quantile, LiesBetweenNeighbours) {
  EXPECT_EQ(quantile({}, 0.5), 0);
  EXPECT_DOUBLE_EQ(quantile({3, 1, 2}, 0.5), 2);
  EXPECT_DOUBLE_EQ(quantile({0, 10}, 0.95), 9.5);
}

}  // namespace
}  // namespace tribin::eval
