#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tribin/core/reason.hpp"
#include "tribin/eval/eval.hpp"

namespace tribin::eval {

/// What was answered for one image.
struct ImageResult {
  int scene = 0;
  int image = 0;
  std::vector<Instance> instances;                  ///< best first
  std::vector<Instance> uncertain;                  ///< listed, not given out; from NDJSON
  std::vector<Reason> rejected;                     ///< from NDJSON
  std::optional<std::vector<std::string>> offered;  ///< parts that were looked for; from NDJSON
  double seconds = -1;                              ///< -1 = not known
};

/// Results of `tribin bop` or of any other method, by scene and image: BOP's CSV (any order of its rows), or NDJSON.
/// \param models  of the data set, to name the objects of a CSV.
/// \throws Error bad_input, naming file and line.
std::vector<ImageResult> read_results(const std::filesystem::path& file, std::span<const Model> models);

}  // namespace tribin::eval
