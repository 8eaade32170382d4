#pragma once

#include <vector>

#include "tribin/part/part.hpp"

namespace tribin {

struct SymmetryOptions {
  double tolerance_mm =
      0;                  ///< [mm] two surfaces are "the same place" below this; 0 = 0.2 % of the diameter, and never
                          ///< less than what the mesh's facets leave open (1.5 times their own sagitta, place by place)
  double telling_mm = 0;  ///< [mm] two surfaces "differ" above this; 0 = 0.5 % of the diameter, see below
  double min_overlap = 0.6;   ///< (0, 1) self-similar poses that keep less of the surface in place are not listed
  int max_self_similar = 24;  ///< >= 0, the best are kept
};

struct SymmetryResult {
  SymmetryGroup group;  ///< of the discrete part the identity comes first, then by angle
  std::vector<SelfSimilarPose>
      self_similar;         ///< best overlap first; none of them, nor two of them, equal modulo `group`
  double tolerance_mm = 0;  ///< used
  double telling_mm = 0;    ///< used
};

/// Finds the proper rotations that leave a part as it is, and the motions that nearly do, from the mesh alone.
///
/// A motion T (part_from_part) is a *symmetry* when at most 0.1 % of the surface is moved further than `telling_mm`
/// from the surface and at least 97 % stays within `tolerance_mm` of it, normals agreeing. A faceted cylinder counts as
/// round: facets that meet under 0.5 rad or less are taken for a tessellation.
///
/// All other motions that are a local best and keep `min_overlap` in place are *self-similar poses*. A part that is all
/// but round keeps most of itself in place after any turn; such a ridge is listed by a few turns, about 40 deg apart.
/// `overlap` is the share of the surface that stays within `tolerance_mm`; `discriminating_points` are places x on the
/// surface where the moved part has none: T^-1 x is further than `telling_mm` from it (at most 400, evenly spread).
/// What the moved part has and the part has not is the list of T^-1, which follows T where the two differ and the cap
/// allows. 0.5 % of the diameter is about five times the depth noise of the scans that tribin is made for (0.1 mm on a
/// part of 100 mm): a place that differs by less tells nothing in one pixel.
///
/// `group.continuous` holds the axis of a part of revolution; `group.discrete` then holds the identity and, where the
/// part has one, a half turn that swaps the ends. A ball is three continuous axes. Mirror images are not looked for.
///
/// \param mesh     triangles in mm; an unoriented mesh is compared two-sided.
/// \throws Error   too_little_data for a mesh without area; bad_option for options out of their ranges.
/// \cost           0.2 to 0.4 s on one thread, little depending on the number of triangles; up to 1 s where these are
/// long and thin. \source         ours. Every symmetry fixes the centre of gravity of the surface, so directions of
/// axes are all that
///                 must be found: principal axes, peaks of the face normals, axes that many normals are perpendicular
///                 to. About each one all turns and all turned half turns are tried on a few hundred surface points,
///                 maxima are polished by damped point-to-plane ICP (which finds the offset of near symmetries), then
///                 judged.
SymmetryResult find_symmetries(const Mesh& mesh, const SymmetryOptions& options = {});

/// Turns about the axes that the part is nearly round about make no difference: a toothed wheel is wanted at its place,
/// at whichever tooth. Recognition then tells one of the turns that the scan leaves, names the turn free, and does not
/// keep the part back for it.
/// \throws Error  bad_option for a part that is not nearly round about any axis.
void declare_free_spin(Part& part);

/// Motions that make no difference, said by others (a data set's models_info.json, a work cell); those that are
/// symmetries of the part anyway are left out.
void declare_symmetry(Part& part, const SymmetryGroup& group);

/// All that makes no difference: the part's own symmetries and what is declared, products of both among the discrete
/// ones, the identity first.
SymmetryGroup all_symmetries(const Part& part);

/// Do two poses of one part mean the same placing, modulo a group?
/// \param distance_mm, angle  how far the centre of its box may be off, and how far it may be turned.
bool same_placing(const Part& part, const SymmetryGroup& group, const Pose& a, const Pose& b, double distance_mm,
                  double angle);

}  // namespace tribin
