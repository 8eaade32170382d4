#pragma once

#include <string>
#include <vector>

#include "tribin/part/part.hpp"

namespace tribin::cli {

/// Normals and segmentation of the paper's scenes by ours and by other libraries, on the same clouds in the same run:
/// the table as text. A peer is a program in the folder `peers` beside this one (bench/peers, -DTRIBIN_PEERS=ON); one
/// that is not there is named with the package that it wants. All run on one thread. Segmentation peers are given the
/// true normals and a cloud without background; ours works on the raw scan and finds both itself.
/// \param scenes  of each part.
std::string compare_with_peers(const std::vector<Part>& parts, int first_seed, int scenes);

/// Decoding of structured-light frames by ours and by OpenCV's GrayCodePattern, each with its own pattern set of the
/// same simulated scene (a part on a table, no shadows): time of one thread, pixels told, wrong columns.
std::string compare_decoding(const Part& part, int seed);

}  // namespace tribin::cli
