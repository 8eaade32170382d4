#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/bundle.hpp"
#include "tribin/capture/calibrate_rig.hpp"

/// The steps of calibrate_rig.
namespace tribin::calibration_detail {

/// "camera left", "the projector": for messages.
std::string words_for(const BoardObserver& observer);

double median(std::vector<double> values);

/// The points of a sighting with their places on the board.
Sight sight_of(const Board& board, const BoardSighting& seen, int device, int view);

/// One observer by itself: its intrinsics, and camera_from_board of the views that it has (sights in their order).
/// \throws Error too_little_data for too few views.
Bundle calibrate_alone(const Board& board, const BoardObserver& observer);

/// All observers in the first one's frame, each board turned to agree. \throws Error too_little_data where an observer
/// shares no view with the others.
Bundle join(const Board& board, std::span<const BoardObserver> observers, const std::vector<Bundle>& alone);

/// Refines with outlying views left out, then with outlying points left out; sets each device's sigma.
/// \throws Error too_little_data where an observer keeps too few views.
void settle(Bundle& bundle, std::span<const BoardObserver> observers);

/// The sd of one coordinate of a device's points, by the median: outliers hardly move it.
double robust_sigma(const Bundle& bundle, int device);

/// Priors of the intrinsics for a device's picture and focal length (calibrate_rig says which).
void set_priors(Device& device, const BoardObserver& observer);

BoardCoverage coverage_of(const Bundle& bundle, const BoardObserver& observer, int device);

/// See ObserverCalibration::ray_sd_px. \param points  of the boards in each ninth.
std::array<double, 9> ray_sd(const Intrinsics& intrinsics, const IntrinsicsCovariance& covariance, int width,
                             int height, const std::array<int, 9>& points);

}  // namespace tribin::calibration_detail
