#pragma once

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {

/// Round surfaces of a mesh. Its vertices lie on the true surface up to the file's rounding, so that the facets about
/// one seed propose a surface, exact growth shows what lies on it, and agreement by chance is next to impossible:
/// fillets that are tangent to everything need no edge to be told by. The largest surface is taken first.
void find_round_on_mesh(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found);

}  // namespace tribin::segmentation_detail
