// Heaps in bins: simulated, looked through by `tribin bop`, judged by `tribin eval`. Data and results stay in
// build/campaign/heaps; what is there is not made again, and results of another build are kept apart.
// usage: campaign_heaps [LEVEL = all] [SCENES a level = 200] [SEED = 7000] [VARIANT = level]
//   LEVEL    easy | dense | hard; empty, foreign: bins without parts, as in dense heaps; all of these
//   VARIANT  level: the smooth depth error of the level; noise: none; scale: none, but an error of scale of sd 0.05 %

#include <cstdio>
#include <string>
#include <vector>

#include "campaign/command.hpp"
#include "campaign/heaps_parts.hpp"

namespace {

namespace fs = std::filesystem;
using namespace tribin::campaign;

struct Run {
  std::string level, scenes, seed, variant;
  std::vector<std::string> parts;
};

bool run_level(const Run& run) {
  const bool without_parts = run.level == "empty" || run.level == "foreign";
  const fs::path folder = fs::path("build/campaign/heaps") / ("seed_" + run.seed);
  fs::create_directories(folder);
  const fs::path data = folder / (run.variant == "level" ? run.level : run.level + "_" + run.variant);
  std::vector<std::string> simulate = {"simulate", "-q",
                                       "--kind",   without_parts ? run.level : "bin",
                                       "--level",  without_parts ? "dense" : run.level,
                                       "--scenes", run.scenes,
                                       "--seed",   run.seed,
                                       "-o",       data.string()};
  if (run.variant != "level") simulate.insert(simulate.end(), {"--systematic", "0"});
  if (run.variant == "scale") simulate.insert(simulate.end(), {"--scale-error", "0.0005"});
  for (const std::string& part : run.parts) simulate.insert(simulate.end(), {"--part", part});
  std::printf("\n=== %s, variant %s\n", run.level.c_str(), run.variant.c_str());
  if (!run_tribin(simulate)) return false;
  // Where parts are, those of the scene are offered, as a cell knows what it is fed with; else all.
  const fs::path targets = without_parts ? fs::path() : data / "test_targets_bop19.json";
  const fs::path results = run_bop(data, targets);
  if (results.empty()) return false;
  std::vector<std::string> eval = {"eval", data.string(), results.string(), "--list", "--in-view"};
  if (!without_parts) eval.insert(eval.end(), {"--targets", targets.string()});
  return run_tribin(eval);
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int i, const char* otherwise) { return std::string(argc > i ? argv[i] : otherwise); };
  Run run{argument(1, "all"), argument(2, "200"), argument(3, "7000"), argument(4, "level"),
          heap_parts("build/campaign/heaps/parts")};
  std::vector<std::string> levels = {run.level};
  if (run.level == "all") levels = {"easy", "dense", "hard", "empty", "foreign"};
  std::printf("%zu part files%s\n", run.parts.size(),
              run.parts.size() > 6 ? "" : "; no real ones: the shared data is not there (set TRIBIN_DATA)");
  for (const std::string& level : levels) {
    run.level = level;
    if (!run_level(run)) return 1;
  }
  return 0;
}
