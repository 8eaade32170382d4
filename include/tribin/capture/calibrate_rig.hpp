#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tribin/capture/board.hpp"
#include "tribin/capture/rig.hpp"

/// Calibration of cameras and projectors from what they see of a board: lenses and places at once.
namespace tribin {

/// fx, fy, cx, cy, k1, k2, p1, p2, k3
inline constexpr std::array<const char*, 9> kIntrinsicNames{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
using IntrinsicsCovariance = Eigen::Matrix<double, 9, 9, Eigen::DontAlign>;

/// A camera, or a projector (which "sees" points of the board where its light meets them), and what it saw.
struct BoardObserver {
  std::string name;
  int width = 0, height = 0;            ///< [px]
  bool projector = false;               ///< its principal point may lie anywhere
  std::vector<BoardSighting> views;     ///< one a view, in the same order for all observers; empty = board not seen
  std::optional<RigCamera> known = {};  ///< calibrated already: its lens and place are held, in this rig's frame
};

/// Which places and tilts the board was seen at, by the views in use.
struct BoardCoverage {
  std::array<int, 9> points{};               ///< in each ninth of the picture, row by row
  double tilt_x_least = 0, tilt_x_most = 0;  ///< of the board about the picture's x axis [rad]
  double tilt_y_least = 0, tilt_y_most = 0;  ///< about its y axis
  double nearest_mm = 0, farthest_mm = 0;    ///< of the boards' middles
};

/// Where a point was seen against where it should be.
struct PointResidual {
  int view = 0;
  Vec2 pixel = Vec2::Zero();   ///< seen
  Vec2 off_px = Vec2::Zero();  ///< seen minus predicted
  bool used = true;            ///< false: left out, alone or with its view
};

struct ObserverCalibration {
  RigCamera camera;  ///< rig_from_camera is the identity for the first one, or as it is known
  IntrinsicsCovariance covariance = IntrinsicsCovariance::Zero();  ///< in the order of kIntrinsicNames
  Matrix6 pose_covariance = Matrix6::Zero();  ///< of rig_from_camera: (dt mm, w rad), R_true = Exp(w) R
  std::array<bool, 9> held{};                 ///< false: the pictures say less than the prior (see calibrate_rig)
  double rms_px = 0;                          ///< root of the mean squared distance of a point from where it should be
  double sigma_px = 0;                        ///< sd of one coordinate
  int points = 0;                             ///< in use
  int dropped_points = 0;                     ///< beyond 5 sigma in used views
  std::array<double, 9>
      ray_sd_px{};  ///< sd of a pixel's ray in the middle of each ninth, by a rotation that fits where the boards were
  BoardCoverage coverage;
  std::vector<PointResidual> residuals;  ///< of all points of all views
};

/// How a view agrees with the rest.
struct BoardView {
  bool used = true;            ///< false: an outlier, or seen by nobody
  std::vector<double> rms_px;  ///< of each observer; NaN = not seen
  Pose rig_from_board = Pose::Identity();
};

struct RigCalibration {
  std::vector<ObserverCalibration> observers;  ///< in the caller's order
  std::vector<BoardView> views;
  double rms_px = 0;  ///< over all points in use of all observers
};

/// The fewest views of each observer: two planes fix a pinhole, the third one says how good it is.
inline constexpr int kFewestViews = 3;
/// A view whose points lie so many times as far off as the median view's is an outlier: light and blur alone spread
/// good views of one recording by less than a factor of 2.
inline constexpr double kOutlierView = 3;

/// Calibrates all observers together: intrinsics, distortion, places to each other, and the board's pose in each view,
/// by least squares of the reprojection in pixels, each observer weighed by its own noise. The first observer's frame
/// is the rig's, where it is not known.
///
/// Outliers: the start is taken from the views whose relative poses agree most; then views beyond kOutlierView are left
/// out and may come back, until nothing changes. Boards that look alike after a turn are turned to agree.
/// Priors keep what the pictures do not hold from being slid by noise: principal point at the picture's middle (sd a
/// tenth of the diagonal; projectors: the height), and the displacement by k1, k2, p1, p2, k3 at the picture's corner
/// (sd 30, 10, 1, 1, 1 % of the corner's distance from the middle).
/// Observers that are known already are held, with covariance 0, so that a projector can be added to a calibrated rig;
/// the first observer must be among them then.
/// Circles whose area is known: the centroid of a circle seen aslant is not its centre's picture; the difference, by
/// the circle's radius and the pose that comes out, is taken off, twice. \param observers  one or more, all with the
/// same number of views. \throws Error    too_little_data for fewer views than kFewestViews, observers that share no
/// view, or boards that
///                   all face a camera so that its focal length stays open; bad_option for a board that cannot be.
/// \cost            a tenth of a second for 2 cameras and 15 views.
/// \source          closed form: Zhang 2000; bundle adjustment with Schur complement: Triggs et al. 2000.
RigCalibration calibrate_rig(const Board& board, std::span<const BoardObserver> observers);

}  // namespace tribin
