#pragma once

#include <span>
#include <vector>

#include "tribin/part/part.hpp"
#include "tribin/pose/scene_depth.hpp"
#include "tribin/recognition/bin.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin {

/// Answers that stand in each other, or in the bin, are moved apart (contacts.hpp); each keeps its old pose if the scan
/// is less likely at the new one. Of two that stay in each other the less sure is taken out, with the reason
/// `penetration`.
/// \param bin  null = not known.
/// \cost  some ms for a heap whose parts do not overlap.
void keep_apart(std::span<const Part> parts, const SceneDepth& scene, const BinSighting* bin,
                std::vector<Instance>& items, std::vector<Reason>& rejected);

/// Self-similar poses that the scan does not tell apart may be told by the bin: what would stand in its floor or walls
/// by more than its pose and the CAD's tolerance explain is struck out, and the likeliest of the others is the answer.
void strike_out_in_bin(const Part& part, const BinSighting& bin, Instance& instance);

}  // namespace tribin
