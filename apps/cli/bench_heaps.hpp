#pragma once

#include <filesystem>
#include <string>

namespace tribin::cli {

/// Heaps of a simulated data set looked through by ours and by other libraries in one run: recall, false answers,
/// errors, CPU time; judged as `tribin eval` does. One thread each. The peers are programs in the folder `peers`; they
/// are given normals and a cloud of parts alone, ours the raw scan.
/// \param dataset  of `tribin simulate`: it has truth/label.png and test_targets_bop19.json.
/// \param scenes   the first ones.
std::string compare_heaps(const std::filesystem::path& dataset, int scenes);

}  // namespace tribin::cli
