#pragma once

#include <span>

#include "tribin/pose/index_render.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin::eval {

/// Does the scan show what tells a pose from its self-similar ones? True when for each of them 25 measured pixels
/// differ from the true pose by more than 0.5 mm (five times the noise of the scans that tribin is made for), both
/// rendered, what the scan shows in front of both left out. A part without self-similar poses is always told. \param
/// near_symmetries  part_from_part.
bool feature_in_view(const Scan& scan, const RenderMesh& mesh, std::span<const Pose> near_symmetries,
                     const Pose& camera_from_part);

}  // namespace tribin::eval
