#include "support/kill_nine.hpp"

#include <gtest/gtest.h>

namespace tribin {
namespace {

// 200 of each: ./test --campaign kill_nine
TEST(KillNine, JournalAndRackAgree) {
  for (const bool nx100 : {true, false}) {
    const test::KillCounts counts = test::kill_again_and_again(TRIBIN_KILL_CHILD, nx100, /*kills=*/3, /*seed=*/11);
    EXPECT_EQ(counts.agree, counts.kills);
    EXPECT_GT(counts.grips, 0);
    EXPECT_EQ(counts.twice + counts.wrong + counts.lost + counts.in_doubt + counts.failed, 0);
  }
}

}  // namespace
}  // namespace tribin
