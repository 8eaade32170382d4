#include "tribin/capture/decode.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "synthetic_frames.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/geometry.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

constexpr int kWidth = 600, kHeight = 200;

/// A slanted surface that sees the whole projector, with a period of about 11 camera pixels.
double slope_column(int u, int v) { return 2.0 + 1276.0 * (u + 0.37 * (v % 7)) / (kWidth + 3); }
double slope_row(int u, int v) { return 3.0 + 790.0 * (v + 0.21 * (u % 5)) / (kHeight + 2); }
double one(int, int) { return 1; }

struct Judged {
  double measured = 0;  ///< share
  double wrong = 0;     ///< share of the measured that are off by a quarter fringe
  double sigma = 0;     ///< rms of the others [px]
};

template <class Truth>
Judged judge(const Image<float>& found, Truth truth, double period) {
  std::size_t measured = 0, wrong = 0;
  double sum = 0;
  for (int v = 0; v < found.height; ++v)
    for (int u = 0; u < found.width; ++u) {
      if (!std::isfinite(found(u, v))) continue;
      ++measured;
      const double off = found(u, v) - (truth(u, v) - 0.5);
      if (std::abs(off) > period / 4)
        ++wrong;
      else
        sum += off * off;
    }
  return {static_cast<double>(measured) / found.size(), static_cast<double>(wrong) / std::max<std::size_t>(1, measured),
          std::sqrt(sum / std::max<std::size_t>(1, measured - wrong))};
}

std::vector<Pattern> without_half_words(std::vector<Pattern> patterns, double period) {
  std::erase_if(patterns, [&](const Pattern& p) { return p.kind == PatternKind::gray && p.period_px < period; });
  return patterns;
}

TEST(Decode, FindsEachColumnWithinTheNoiseLaw) {
  for (const PatternCode code : {PatternCode::gray, PatternCode::heterodyne, PatternCode::micro})
    for (const int steps : {3, 4, 5, 8})
      for (const double modulation : {20.0, 60.0}) {
        SCOPED_TRACE(static_cast<int>(code) * 1000 + steps * 100 + modulation);
        const auto patterns = make_patterns({.code = code, .steps = steps});
        const test::SyntheticCamera camera{.modulation = modulation, .blur_px = 0};
        const Decoded d =
            decode(test::synthetic_frames(patterns, kWidth, kHeight, camera, 7 * steps, slope_column, slope_row, one),
                   {.image_noise = steps == 3 ? 2.0 : 0.0});
        EXPECT_NEAR(d.image_noise, 2.02, 0.1);  // with the rounding
        const Judged j = judge(d.column, slope_column, 16);
        RecordProperty(std::to_string(static_cast<int>(code)) + "_" + std::to_string(steps) + "_" +
                           std::to_string(static_cast<int>(modulation)),
                       std::to_string(j.measured) + " " + std::to_string(j.wrong) + " " + std::to_string(j.sigma));
        // A micro set tells the order by single images: weak fringes leave it open, and it says so.
        const bool weak_micro = code == PatternCode::micro && modulation < 60;
        EXPECT_LE(j.wrong, weak_micro ? 2e-5 : 0);
        EXPECT_GT(j.measured, weak_micro ? 0.5 : 0.99);
        EXPECT_NEAR(j.sigma / (d.column_noise / modulation), 1, 0.1);
      }
}

// The figure: fewer than 1 wrong order in 100,000 at modulation 20 and image noise 2, with a defocus that blurs
// the code's edges. 600,000 pixels for each set.
TEST(Decode, WrongOrdersAreRarerThanOneIn100000) {
  for (const bool half_words : {true, false})
    for (const double blur : {0.0, 1.5}) {
      auto patterns = make_patterns({});
      if (!half_words) patterns = without_half_words(patterns, 16);
      double wrong = 0, measured = 0;
      for (unsigned seed = 1; seed <= 5; ++seed) {
        const test::SyntheticCamera camera{.modulation = 20, .blur_px = blur};
        const Decoded d =
            decode(test::synthetic_frames(patterns, kWidth, kHeight, camera, seed, slope_column, slope_row, one));
        const Judged j = judge(d.column, slope_column, 16);
        wrong += j.wrong * j.measured, measured += j.measured;
        EXPECT_GT(j.measured, 0.98);
      }
      SCOPED_TRACE(std::to_string(half_words) + " blur " + std::to_string(blur));
      EXPECT_LT(wrong / measured, 1e-5);
    }
}

TEST(Decode, ThresholdsMayBeOffWithoutHalfWords) {
  // Codes thresholded by a wrong white level: the edges move by a pixel and more, the orders stay right.
  auto patterns = without_half_words(make_patterns({}), 16);
  auto frames = test::synthetic_frames(patterns, kWidth, kHeight, {.modulation = 60, .blur_px = 1.5}, 1, slope_column,
                                       slope_row, one);
  for (std::size_t i = 0; i < patterns.size(); ++i)
    if (patterns[i].kind == PatternKind::white)
      for (auto& value : frames.grey8[i].data) value = static_cast<std::uint8_t>(value + 40);
  const Judged j = judge(decode(frames).column, slope_column, 16);
  EXPECT_LT(j.wrong, 1e-5);
  EXPECT_GT(j.measured, 0.98);
}

TEST(Decode, SaysWhyAPixelIsInvalid) {
  const auto patterns = make_patterns({.steps = 4});
  // Left third black paint, middle good, right third too bright.
  const auto albedo = [](int u, int) { return u < 200 ? 0.01 : u < 400 ? 1.0 : 3.0; };
  const Decoded d = decode(test::synthetic_frames(patterns, kWidth, kHeight, {.modulation = 80, .noise = 1}, 3,
                                                  slope_column, slope_row, albedo));
  int dark = 0, good = 0, saturated = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const auto why = static_cast<Invalid>(d.invalid_reason(u, v));
      EXPECT_EQ(std::isfinite(d.column(u, v)), why == Invalid::measured);
      dark += u < 200 && why == Invalid::dark;
      good += u >= 200 && u < 400 && why == Invalid::measured;
      saturated += u >= 400 && why == Invalid::saturated;
    }
  EXPECT_GT(dark, 0.99 * 200 * kHeight);
  EXPECT_GT(good, 0.99 * 200 * kHeight);
  EXPECT_GT(saturated, 0.5 * 200 * kHeight);  // the others keep three images below 255
}

TEST(Decode, OneSaturatedImageIsLeftOut) {
  const auto patterns = make_patterns({.steps = 4});
  const test::SyntheticCamera camera{.modulation = 120, .ambient = 20, .noise = 1, .blur_px = 0};  // up to 260
  const Decoded d = decode(test::synthetic_frames(patterns, kWidth, kHeight, camera, 3, slope_column, slope_row, one));
  const Judged j = judge(d.column, slope_column, 16);
  EXPECT_GT(j.measured, 0.99);
  EXPECT_EQ(j.wrong, 0);
  EXPECT_LT(j.sigma, 2 * d.column_noise / 120);
}

TEST(Decode, ExposuresAreMerged) {
  std::vector<Pattern> both;
  FrameStack frames;
  const auto albedo = [](int u, int) { return u < 300 ? 0.06 : 1.0; };
  for (const double exposure : {5.0, 40.0}) {
    auto patterns = make_patterns({});
    for (Pattern& p : patterns) p.exposure_ms = exposure;
    const test::SyntheticCamera camera{.modulation = 80, .blur_px = 0, .gain = exposure / 5};
    FrameStack part = test::synthetic_frames(patterns, kWidth, kHeight, camera, static_cast<unsigned>(exposure),
                                             slope_column, slope_row, albedo);
    frames.patterns.insert(frames.patterns.end(), patterns.begin(), patterns.end());
    frames.grey8.insert(frames.grey8.end(), part.grey8.begin(), part.grey8.end());
  }
  const Decoded d = decode(frames);
  const Judged j = judge(d.column, slope_column, 16);
  EXPECT_GT(j.measured, 0.99);
  EXPECT_LT(j.wrong, 1e-5);
  EXPECT_NEAR(d.modulation(100, 50), 0.06 * 80 * 8, 4);  // dark half: the long exposure
  EXPECT_NEAR(d.modulation(500, 50), 80, 4);             // bright half: the short one
}

TEST(Decode, SixteenBitsAreScaledAndRowsAreFound) {
  const auto patterns = make_patterns({.rows = true});
  const test::SyntheticCamera camera{.full_scale = 4095};
  const FrameStack frames = test::synthetic_frames(patterns, kWidth, kHeight, camera, 3, slope_column, slope_row, one);
  const Decoded d = decode(frames, {.full_scale = 4095});
  EXPECT_EQ(judge(d.column, slope_column, 16).wrong, 0);
  EXPECT_EQ(judge(d.row, slope_row, 16).wrong, 0);
  EXPECT_GT(judge(d.row, slope_row, 16).measured, 0.99);
  EXPECT_NEAR(d.image_noise, 2, 0.1);
}

TEST(Decode, SameBytesForAnyNumberOfThreads) {
  const FrameStack frames =
      test::synthetic_frames(make_patterns({}), kWidth, kHeight, {.modulation = 8}, 3, slope_column, slope_row, one);
  set_thread_count(1);
  const Decoded a = decode(frames);
  set_thread_count(4);
  const Decoded b = decode(frames);
  set_thread_count(0);
  EXPECT_EQ(a.invalid_reason.data, b.invalid_reason.data);
  for (std::size_t i = 0; i < a.column.size(); ++i)
    ASSERT_TRUE(std::isnan(a.column.data[i]) ? std::isnan(b.column.data[i]) : a.column.data[i] == b.column.data[i]);
}

TEST(Decode, TellsCodeAndPhaseThatDoNotBelongTogether) {
  const auto patterns = make_patterns({});
  FrameStack frames = test::synthetic_frames(patterns, kWidth, kHeight, {}, 1, slope_column, slope_row, one);
  EXPECT_TRUE(decode(frames).warnings.empty());
  // As a description that takes half-stripe words for whole ones, or shifts the fringes by a quarter.
  for (Pattern& p : frames.patterns)
    if (p.kind == PatternKind::gray) p.period_px *= 2;
  EXPECT_EQ(decode(frames).warnings.size(), 1u);
  frames.patterns = patterns;
  for (Pattern& p : frames.patterns)
    if (p.kind == PatternKind::phase) p.shift_rad += kPi / 2;
  EXPECT_EQ(decode(frames).warnings.size(), 1u);
}

TEST(Decode, RefusesWhatIsNoSet) {
  auto patterns = make_patterns({});
  const auto refused = [](std::vector<Pattern> set, const std::string& words) {
    FrameStack frames = test::synthetic_frames(set, 8, 8, {}, 1, slope_column, slope_row, one);
    try {
      decode(frames);
      FAIL() << "wanted: " << words;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  auto set = patterns;
  std::erase_if(set, [](const Pattern& p) { return p.kind == PatternKind::phase; });
  refused(set, "three phase images");
  set = patterns;
  std::erase_if(set, [](const Pattern& p) { return p.bit == 2; });
  refused(set, "each half the one before");
  set = patterns;
  std::erase_if(set, [](const Pattern& p) { return p.kind == PatternKind::gray; });
  refused(set, "Gray images, or phase images of two periods");
  set = {patterns[0], patterns[1]};
  refused(set, "no phase images");
}

}  // namespace
}  // namespace tribin
