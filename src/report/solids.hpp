#pragma once

#include "report/canvas.hpp"
#include "report/pictures.hpp"
#include "report/sighting.hpp"

namespace tribin::report {

// The pictures (e) to (j) of the paper's figures 4 and 5 as canvases; the page and the figures of the docs show them.

/// Looks at points from the camera's side, 24 degrees lower and 14 degrees from the left, so that steps and heights
/// show. \param size_px  of the square picture.
View view_of(const std::vector<Vec3f>& points, const Pose& camera_from_points, int size_px);

struct ScanCanvases {
  Canvas scan;          ///< (e) coloured by height
  Canvas segmentation;  ///< (f) by type
  Canvas observed;      ///< (g) the fitted surfaces
  double height_mm = 0;
};
ScanCanvases scan_canvases(const Observation& seen, const Sighting& where, const View& view);

struct CadCanvases {
  Canvas cad;    ///< (h)
  Canvas model;  ///< (i)
};
CadCanvases cad_canvases(const Part& part, const Pose& camera_from_part, const View& view);

/// (j) the CAD's outline on the scan.
Canvas pose_canvas(const Observation& seen, const Sighting& where, const Part& part, const Pose& camera_from_part,
                   const View& view);

}  // namespace tribin::report
