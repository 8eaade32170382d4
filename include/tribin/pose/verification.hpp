#pragma once

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

struct VerificationOptions {
  int step_px = 1;  ///< rendered pixels
  double tolerance_mm =
      0;  ///< a pixel within this of the surface is supported even if the noise is smaller (coarse poses)
  double cad_sigma_mm = 0;  ///< how far the part may be from its CAD
  double diameter_mm = 1;   ///< of the part: the scale of "near" and "far" behind
};

/// What each pixel of a rendered pose says, and what the outline says.
struct Verification {
  int pixels = 0;     ///< of the silhouette inside the image, without what a sensor that draws steps out mixes there
  int supported = 0;  ///< the scan is at the surface, within 5 sigma
  int misfit = 0;     ///< the scan is near the surface, but not at it
  int violated = 0;   ///< the scan is far behind: the camera sees through the part; or the part lies below a floor
  int occluded = 0;   ///< something lies in front
  int no_data = 0;
  double gain = 0;         ///< summed evidence in pixels of the full image: at most one a pixel
  int outline = 0;         ///< supported outline pixels beside which the scan tells: nothing nearer hides it
  int outline_breaks = 0;  ///< of those, where the surface ends there: what is seen beside it lies farther away
  double rms_sigma = 0;    ///< of the supported residuals, in local sigma

  double visible_fraction() const { return pixels ? double(pixels - occluded) / pixels : 0; }
  /// Share of the silhouette that is measured and tells for or against.
  double measured_fraction() const { return pixels ? double(judged()) / pixels : 0; }
  double support() const { return judged() ? double(supported) / judged() : 0; }
  double free_space() const { return judged() ? double(violated) / judged() : 0; }
  double contour() const { return outline ? double(outline_breaks) / outline : 0; }
  /// Mean evidence of a pixel that could be judged: 1 = all at the surface, below 0 = refuted.
  double fit() const;
  int judged() const { return supported + misfit + violated; }

  int step_px = 1;
};

/// Renders the part at a pose and compares every pixel and the outline with the scan.
/// \source three states and contour evidence: ours (docs/recognition.md). Faces that lie in a floor or a wall are
/// supported
///         by it and never seen through; only the outline, beyond which the floor goes on, gives them away.
Verification verify_pose(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                         const VerificationOptions& options);

}  // namespace tribin
