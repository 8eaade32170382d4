#pragma once

#include "capture/ideal_view.hpp"
#include "tribin/capture/triangulate.hpp"

namespace tribin::capture_detail {

/// Median and spread of loose values.
EpipolarCheck summary_of(std::vector<double> values);

/// Judges the rows of matched points. \param match  column in the second view of each pixel of the first, NaN = none.
/// With measured projector rows, these are compared; else the pictures: in each square of 64 px, brightness of the
/// first = gain * brightness of the second moved by dy + offset, by least squares (Lucas and Kanade, one step, one
/// direction).
EpipolarCheck check_epipolar(const ViewImage& first, const ViewImage& second, const Image<float>& match);

/// Appends a warning to the scan where the check fails.
void warn_of_calibration(const EpipolarCheck& check, Scan& scan);

}  // namespace tribin::capture_detail
