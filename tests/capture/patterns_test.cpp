#include "tribin/capture/patterns.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

TEST(Patterns, GrayNeighboursDifferInOneBitAndEachWordIsItsOwn) {
  for (const int width : {64, 1000, 1280, 1920}) {
    const auto patterns = make_patterns({.width = width});
    std::set<std::vector<bool>> words;
    std::vector<bool> before;
    for (int x = 0; x < width; x += 8) {  // half stripes of 8 px
      std::vector<bool> word;
      for (const Pattern& p : patterns)
        if (p.kind == PatternKind::gray) word.push_back(pattern_value(p, x + 0.5) > 0.5);
      EXPECT_TRUE(words.insert(word).second);
      if (!before.empty()) {
        int changed = 0;
        for (std::size_t i = 0; i < word.size(); ++i) changed += word[i] != before[i];
        EXPECT_EQ(changed, 1);
      }
      before = word;
    }
  }
}

TEST(Patterns, CloseFrequenciesHaveNoWideStripes) {
  for (const PatternCode code : {PatternCode::heterodyne, PatternCode::micro})
    for (const Pattern& p : make_patterns({.code = code, .width = 1920, .period_px = 12}))
      if (p.kind == PatternKind::phase) {
        EXPECT_GE(p.period_px, 12 - 1e-9);
        EXPECT_LE(p.period_px, 24);
      }
}

TEST(Patterns, PicturesAreTheValuesAtPixelMiddles) {
  const auto patterns = make_patterns({.width = 40, .height = 30, .rows = true});
  for (const Pattern& p : patterns) {
    const Image<std::uint8_t> picture = draw_pattern(p, 40, 30);
    for (const auto& [u, v] : {std::pair{0, 0}, {39, 29}, {7, 8}, {8, 7}})
      EXPECT_NEAR(picture(u, v), 255 * pattern_value(p, 0.5 + (p.axis == PatternAxis::column ? u : v)), 0.5 + 1e-9);
  }
}

TEST(Patterns, BadOptionsAreNamed) {
  EXPECT_THROW(make_patterns({.steps = 2}), Error);
  EXPECT_THROW(make_patterns({.period_px = 15}), Error);
  EXPECT_THROW(make_patterns({.width = 4}), Error);
  EXPECT_THROW(make_patterns({.columns = false}), Error);
}

}  // namespace
}  // namespace tribin
