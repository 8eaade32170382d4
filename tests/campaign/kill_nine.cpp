// kill -9 at random moments: does the rack hold what the journal says?
// usage: campaign_kill_nine [KILLS] [SEED] [PROGRAM]
#include "support/kill_nine.hpp"

#include <cstdlib>

int main(int argc, char** argv) {
  const int kills = argc > 1 ? std::atoi(argv[1]) : 200;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const std::string program = argc > 3 ? argv[3] : TRIBIN_KILL_CHILD;
  bool good = true;
  for (const bool nx100 : {true, false}) {
    const tribin::test::KillCounts counts = tribin::test::kill_again_and_again(program, nx100, kills, seed);
    print(nx100 ? "nx100" : "hses", counts);
    std::fflush(stdout);
    good = good && counts.agree == counts.kills && counts.twice + counts.wrong + counts.lost + counts.in_doubt == 0;
  }
  return good ? 0 : 1;
}
