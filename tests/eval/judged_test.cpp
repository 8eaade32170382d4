#include "tribin/eval/judged.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "part/shapes.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/eval/figures.hpp"

namespace tribin::eval {
namespace {

Model model_from(const Mesh& mesh, const std::string& name, int id, double diameter) {
  Model model;
  model.name = name;
  model.id = id;
  model.vertices = mesh.vertices;
  model.surface = points_on(mesh, 5000);
  model.diameter_mm = diameter;
  return model;
}

/// A square bar of 40 x 40 x 80 with a groove's worth of asymmetry left out: its quarter turns about z are flips, since
/// the model claims no symmetry.
Model bar() {
  Model model = model_from(test::moved(test::box(40, 40, 80), Pose(Eigen::Translation3d(-20, -20, -40))), "bar", 1,
                           std::sqrt(40.0 * 40 + 40 * 40 + 80 * 80));
  model.box_center = Vec3::Zero();
  return model;
}

Pose at(double x, double turn_z_deg = 0) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(0, 0, turn_z_deg * kDegree));
  pose.translation() = Vec3(x, 0, 800);
  return pose;
}

Instance answer_of(const std::string& part, const Pose& pose, double score) {
  Instance out;
  out.part = part;
  out.score = score;
  out.camera_from_part = pose;
  return out;
}

TEST(PointsOn, SpreadEvenlyOverTheArea) {
  const Mesh box = test::box(10, 20, 40);
  const std::vector<Vec3f> points = points_on(box, 7000);
  int on_smallest = 0;  // two faces of 10 x 20 of 2800 mm^2
  for (const Vec3f& p : points) on_smallest += p.z() < 1e-4f || p.z() > 40 - 1e-4f;
  EXPECT_NEAR(on_smallest / 7000.0, 400.0 / 2800, 0.005);
}

TEST(Overlap, IsOneForTheSamePlaceAndFallsWithTheShift) {
  const Model model = bar();
  EXPECT_EQ(overlap(model, at(0), at(0, 90), 2), 1);
  EXPECT_LT(overlap(model, at(0), at(30), 2), 0.7);
  EXPECT_EQ(overlap(model, at(0), at(300), 2), 0);
}

TEST(JudgeResults, TellsWhyAnAnswerIsFalse) {
  Model other = bar();
  other.name = "other";
  const std::vector<Model> models = {bar(), other};
  ImageTruth truth{3,
                   0,
                   "easy",
                   {{"bar", at(0), 0.9, 0, 0},
                    {"bar", at(200), 0.8, 0, 0},
                    {"bar", at(400), 0.6, 0, 0},
                    {"other", at(600), 0.9, 0, 0},
                    {"bar", at(800), 0.2, 0, 0}}};
  ImageResult result;
  result.scene = 3;
  result.instances = {answer_of("bar", at(0.5), 0.99),      // found
                      answer_of("bar", at(0), 0.98),        // duplicate
                      answer_of("bar", at(200, 90), 0.97),  // flip
                      answer_of("bar", at(420, 0), 0.96),   // wrong place
                      answer_of("bar", at(601), 0.95),      // wrong class
                      answer_of("bar", at(1200), 0.94),     // nothing there
                      answer_of("bar", at(800), 0.93)};     // right, but not asked for
  result.instances[2].alternatives.push_back({at(200), 0.4, "a groove"});
  const Judged judged = judge_results(std::vector{truth}, std::vector{result}, models);
  const Verdict wanted[] = {Verdict::found,       Verdict::duplicate,     Verdict::flip,     Verdict::wrong_place,
                            Verdict::wrong_class, Verdict::nothing_there, Verdict::not_asked};
  ASSERT_EQ(judged.answers.size(), std::size(wanted));
  for (std::size_t i = 0; i < std::size(wanted); ++i) EXPECT_EQ(judged.answers[i].verdict, wanted[i]) << i;
  EXPECT_TRUE(judged.answers[2].told);
  EXPECT_EQ(judged.answers[4].confused_with, "other");

  const Figures figures = all_figures(judged).front();
  EXPECT_EQ(figures.recall_40.count, 1);
  EXPECT_EQ(figures.recall_40.of, 4);
  EXPECT_EQ(figures.recall_70.of, 3);
  EXPECT_EQ(figures.false_share.count, 5);
  EXPECT_EQ(figures.false_share.of, 7);
  EXPECT_NEAR(figures.median_mm.value, 0.5, 1e-9);
}

TEST(JudgeResults, AsksOnlyForPartsThatWereOffered) {
  Model other = bar();
  other.name = "other";
  const std::vector<Model> models = {bar(), other};
  const ImageTruth truth{1, 0, "", {{"bar", at(0), 1, 0, 0}, {"other", at(300), 1, 0, 0}}};
  ImageResult result;
  result.scene = 1;
  result.offered = {"other"};
  result.instances = {answer_of("other", at(300), 0.9)};
  const Judged judged = judge_results(std::vector{truth}, std::vector{result}, models);
  ASSERT_EQ(judged.truths.size(), 1u);
  EXPECT_EQ(judged.truths[0].answer, 0);
}

TEST(JudgeResults, MissesAllOfAnImageWithoutResult) {
  const std::vector<Model> models = {bar()};
  const std::vector<ImageTruth> truths = {{1, 0, "", {{"bar", at(0), 1, 0, 0}}}, {2, 0, "", {}}};
  ImageResult result;
  result.scene = 2;
  result.instances = {answer_of("bar", at(0), 0.9)};
  const Judged judged = judge_results(truths, std::vector{result}, models);
  EXPECT_EQ(judged.images_without_result, 1);
  EXPECT_EQ(judged.images_without_parts, 1);
  EXPECT_EQ(judged.given_without_parts, 1);
  EXPECT_EQ(judged.truths[0].answer, -1);
}

/// Errors drawn from the covariance that an answer claims lie in its 95 % ellipsoid 95 times in 100, with and without a
/// direction that is free.
TEST(ChiSquare, CoversWhatTheCovarianceClaims) {
  for (const bool round : {false, true}) {
    std::mt19937 random(round ? 7 : 5);
    std::normal_distribution<double> gauss;
    int inside = 0;
    constexpr int kTrials = 2000;
    for (int trial = 0; trial < kTrials; ++trial) {
      Instance answer;
      answer.camera_from_part = at(10 * gauss(random), 90 * gauss(random));
      const Vec3 axis = answer.camera_from_part.linear() * Vec3::UnitX();
      Eigen::Matrix<double, 6, 6> root;
      for (int i = 0; i < 36; ++i) root.data()[i] = gauss(random) * (i % 6 < 3 ? 0.1 : 0.001);
      root.row(3) *= 0.01, root.row(4) *= 0.01, root.row(5) *= 0.01;
      Vector6 free;
      free << Vec3(5, 0, 0).cross(axis), axis;  // turns about an axis through a point beside the origin
      free.normalize();
      Eigen::Matrix<double, 6, 6> off = Eigen::Matrix<double, 6, 6>::Identity();
      if (round) {
        off -= Eigen::Matrix<double, 6, 1>(free) * Eigen::Matrix<double, 6, 1>(free).transpose();
        answer.free_directions.push_back(free);
      }
      answer.covariance = off * root * root.transpose() * off;
      Eigen::Matrix<double, 6, 1> draw;
      for (int i = 0; i < 6; ++i) draw[i] = gauss(random);
      Vector6 error = off * root * draw;
      if (round) error += 0.3 * gauss(random) * free * 1e-3;  // what is free is never an error
      inside += chi_square(answer, moved(answer.camera_from_part, error)) < (round ? 11.0705 : 12.5916);
    }
    const Share share = share_of(inside, kTrials);
    EXPECT_LT(share.low, 0.95);
    EXPECT_GT(share.high, 0.95);
  }
}

TEST(Confidence, SeesWhetherTheScoreIsAProbability) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  for (const double bias : {0.0, 0.2}) {
    Judged judged;
    for (int i = 0; i < 4000; ++i) {
      JudgedAnswer answer;
      const double right = 0.7 + 0.3 * uniform(random);
      answer.score = right - bias;
      answer.verdict = uniform(random) < right ? Verdict::found : Verdict::nothing_there;
      judged.answers.push_back(answer);
    }
    const Confidence confidence = confidence_of(judged);
    EXPECT_NEAR(confidence.calibration_error.value, bias > 0 ? bias : confidence.calibration_floor, 0.015);
    EXPECT_LT(confidence.calibration_floor, 0.02);
  }
}

TEST(Confidence, GivesOutTheBestUntilOneInAHundredIsFalse) {
  Judged judged;
  for (int i = 0; i < 400; ++i) {
    JudgedAnswer answer;
    answer.score = 1 - i / 1000.0;
    answer.verdict = i >= 200 && i % 20 == 0 ? Verdict::flip : Verdict::found;
    JudgedTruth truth;
    truth.visible = 1;
    truth.answer = answer.verdict == Verdict::found ? i : -1;
    judged.truths.push_back(truth);
    judged.answers.push_back(answer);
  }
  const Confidence confidence = confidence_of(judged);
  // Up to and with answer 239: 240 given out, 2 false (200 and 220); the third, 240, would be 1.2 %.
  EXPECT_NEAR(confidence.score_at_risk, 1 - 239 / 1000.0, 1e-9);
  EXPECT_EQ(confidence.given_at_risk.count, 238);
  EXPECT_EQ(confidence.given_at_risk.of, 400);
}

TEST(QuantileEstimate, HoldsTheTrueQuantileNineteenTimesInTwenty) {
  std::mt19937 random(9);
  std::normal_distribution<double> gauss;
  int held = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<double> values;
    for (int i = 0; i < 100; ++i) values.push_back(gauss(random));
    const Estimate estimate = quantile_estimate(values, 0.5);
    held += estimate.low <= 0 && 0 <= estimate.high;
  }
  EXPECT_GE(held, 370);  // order statistics are a little wide
  EXPECT_LE(held, 396);
}

TEST(ReadResults, TakesTheCsvOfAnyMethodAndNamesWhatIsWrong) {
  const test::TemporaryFolder folder;
  const std::vector<Model> models = {bar()};
  const auto written = [&](const std::string& text) { return folder.write("r.csv", text); };
  const std::string head = "scene_id,im_id,obj_id,score,R,t,time\n";
  const auto results = read_results(
      written(head + "2,5,1,0.5,1 0 0 0 1 0 0 0 1,1 2 3,-1\n1,0,1,0.9,1 0 0 0 1 0 0 0 1,4 5 6,0.25\n"), models);
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[0].scene, 1);
  EXPECT_EQ(results[0].seconds, 0.25);
  EXPECT_EQ(results[1].instances[0].part, "bar");
  EXPECT_EQ(Vec3(results[1].instances[0].camera_from_part.translation()), Vec3(1, 2, 3));
  for (const char* bad : {"1,0,1,0.9,1 0 0 0 1 0 0 0,4 5 6,0\n", "1,0,7,0.9,1 0 0 0 1 0 0 0 1,4 5 6,0\n", "nonsense\n"})
    try {
      read_results(written(head + bad), models);
      ADD_FAILURE() << bad;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(e.what()).find("line 2"), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace tribin::eval
