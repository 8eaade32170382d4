#pragma once

#include <span>
#include <vector>

#include "candidates.hpp"

namespace tribin {

// Pixels that a polished pose is fitted and compared on: enough for 0.1 sigma of any mean, a few ms a pose.
inline constexpr double kPolishPixels = 4000;
inline constexpr double kCompareFew = 1000;  // and those that all its rivals are sifted on
// Poses that a comparison leaves within so many nats are compared again on all pixels.
inline constexpr double kUndecided = 30;

/// The pose turned about a line of the part.
Pose turned(const Pose& pose, const ContinuousSymmetry& line, double angle);
/// By what angle a motion of the part turns about a line: the inverse of `turned`, for motions that are near such
/// turns.
double angle_about(const ContinuousSymmetry& line, const Pose& motion);

/// The pose after three steps of refinement with outlines on few pixels: near enough to be compared with others.
Pose settled_on_few(const SceneDepth& scene, const Part& part, const Pose& pose, int step_px);

/// Poses that the part's own shape confuses with this one: self-similar ones, half turns about the faces that are seen.
/// Of a nearly round part the other sides only, at their own likeliest spins.
std::vector<Pose> rivals(const SceneDepth& scene, const Part& part, const Pose& pose);

/// Another of the part's faces, or the same one turned, in the place of one that is seen: flush with each of its
/// corners, in quarter turns. Of a prism of which one face is seen, the scan may tell which one it is by its outline
/// only, and a search that has begun with a wrong one does not leave it.
/// \param seen  the primitives that most of what is seen belongs to.
void add_face_for_face(const Part& part, std::span<const Primitive* const> seen, const Pose& pose,
                       std::vector<Pose>& out);

/// Spins about the axes that the part is nearly round about: the best rendered poses over the whole turn, each brought
/// to its best angle.
/// \param most  that are wanted of each axis: as many as the scan hardly tells apart, else the best eight.
std::vector<Pose> spins(const SceneDepth& scene, const Part& part, const Pose& pose, std::size_t most = 24);

/// The pose moved to both sides along the direction that its information holds least: slots and steps make local minima
/// there that refinement does not leave.
void add_weakest_moves(const Part& part, const PoseCandidate& from, std::vector<Pose>& out);

}  // namespace tribin
