#include "tribin/sim/levels.hpp"

#include <array>

#include "tribin/core/error.hpp"

namespace tribin::sim {
namespace {

constexpr std::array<LevelSettings, 3> kLevels = {{
    {"easy", 3, 10, 1, 2, 1.5, 0.5, 0.0002, 0.5, 0, 4 * kDegree, 0, 0, 0, 0},
    {"dense", 12, 25, 1, 3, 2.0, 0.8, 0.0005, 1.0, 0.15, 8 * kDegree, 0, 0, 0, 0},
    {"hard", 20, 40, 2, 3, 3.0, 1.0, 0.0010, 1.0, 0.30, 15 * kDegree, 0.10, 0.25, 2, 6},
}};

}  // namespace

Level level_of(const std::string& name) {
  for (std::size_t i = 0; i < kLevels.size(); ++i)
    if (name == kLevels[i].name) return static_cast<Level>(i);
  throw Error(ErrorCode::bad_option, "--level is \"" + name + "\"; wanted easy, dense or hard");
}

const LevelSettings& settings_of(Level level) { return kLevels[static_cast<std::size_t>(level)]; }

}  // namespace tribin::sim
