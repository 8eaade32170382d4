#include "tribin/capture/calibrate_rig.hpp"

#include <cmath>
#include <limits>

#include "capture/calibration_steps.hpp"
#include "capture/circle_bias.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using namespace calibration_detail;

/// sd of a coordinate by the squares of what is in use, each device's share of the parameters taken off.
void set_final_sigmas(Bundle& bundle) {
  std::vector<double> squares(bundle.devices.size(), 0), count(bundle.devices.size(), 0), taken(bundle.devices.size());
  std::vector<double> in_view(bundle.view_used.size(), 0);
  const auto used_points = [](const Sight& s) {
    double n = 0;
    for (char u : s.used) n += u;
    return n;
  };
  for (const Sight& s : bundle.sights)
    if (bundle.view_used[static_cast<std::size_t>(s.view)]) in_view[static_cast<std::size_t>(s.view)] += used_points(s);
  for (std::size_t d = 0; d < taken.size(); ++d) taken[d] = bundle.devices[d].fixed ? 0 : d == 0 ? 9 : 15;
  for (const Sight& s : bundle.sights) {
    const auto d = static_cast<std::size_t>(s.device), v = static_cast<std::size_t>(s.view);
    if (!bundle.view_used[v] || in_view[v] == 0) continue;
    const std::vector<Vec2> off = residuals(bundle, s);
    for (std::size_t i = 0; i < off.size(); ++i)
      if (s.used[i]) squares[d] += off[i].squaredNorm();
    count[d] += 2 * used_points(s);
    taken[d] += 6 * used_points(s) / in_view[v];
  }
  for (std::size_t d = 0; d < bundle.devices.size(); ++d)
    bundle.devices[d].sigma = std::max(1e-3, std::sqrt(squares[d] / std::max(1.0, count[d] - taken[d])));
}

RigCamera camera_of(const Device& device, const BoardObserver& observer) {
  RigCamera out;
  const Intrinsics& p = device.intrinsics;
  out.name = observer.name;
  out.camera = {observer.width, observer.height, p[0], p[1], p[2], p[3]};
  out.distortion = {p[4], p[5], p[6], p[7], p[8]};
  out.rig_from_camera = device.rig_from_device;
  return out;
}

/// All observers, from nothing.
Bundle solve(const Board& board, std::span<const BoardObserver> observers) {
  std::vector<Bundle> alone;
  for (const BoardObserver& o : observers) alone.push_back(calibrate_alone(board, o));
  Bundle bundle = observers.size() == 1 ? alone[0] : join(board, observers, alone);
  if (observers.size() > 1) settle(bundle, observers);
  for (int round = 0; round < 2; ++round) {
    set_final_sigmas(bundle);
    refine(bundle, Loss::squares);
  }
  return bundle;
}

}  // namespace

RigCalibration calibrate_rig(const Board& board, std::span<const BoardObserver> observers) {
  validate(board);
  TRIBIN_ASSERT(!observers.empty());
  const std::size_t views = observers[0].views.size();
  bool any_known = false;
  for (const BoardObserver& o : observers) {
    TRIBIN_ASSERT(o.views.size() == views && o.width > 0 && o.height > 0);
    any_known = any_known || o.known;
  }
  TRIBIN_ASSERT(!any_known || observers[0].known);  // it holds the rig's frame
  Bundle bundle = solve(board, observers);
  std::vector<BoardObserver> centred(observers.begin(), observers.end());
  // A second round moves what is left of the first one: the bias changes with the pose by a hundredth of itself.
  for (int round = 0; round < 2 && centre_circles(board, bundle, observers, centred); ++round)
    bundle = solve(board, centred);
  const Eigen::MatrixXd all = covariance(bundle);

  RigCalibration out;
  out.views.resize(views);
  for (std::size_t v = 0; v < views; ++v) {
    out.views[v].used = bundle.view_used[v] != 0;
    out.views[v].rms_px.assign(observers.size(), std::numeric_limits<double>::quiet_NaN());
    out.views[v].rig_from_board = bundle.rig_from_board[v];
  }
  double squares = 0;
  int points = 0;
  for (std::size_t d = 0; d < observers.size(); ++d) {
    const Device& device = bundle.devices[d];
    ObserverCalibration o;
    o.camera = camera_of(device, observers[d]);
    const int at = 15 * static_cast<int>(d);
    o.covariance = all.block<9, 9>(at, at);
    o.pose_covariance = all.block<6, 6>(at + 9, at + 9);
    // What the prior alone would say is half of the variance or more: not held.
    for (int i = 0; i < 9; ++i)
      o.held[static_cast<std::size_t>(i)] =
          !(device.prior_sd[i] > 0) || o.covariance(i, i) < 0.5 * device.prior_sd[i] * device.prior_sd[i];
    o.sigma_px = device.sigma;
    double own = 0;
    for (const Sight& s : bundle.sights) {
      if (s.device != static_cast<int>(d)) continue;
      const BoardView& view = out.views[static_cast<std::size_t>(s.view)];
      double sum = 0;
      int used = 0;
      const std::vector<Vec2> off = residuals(bundle, s);
      for (std::size_t i = 0; i < off.size(); ++i) {
        o.residuals.push_back({s.view, s.pixel[i], -off[i], view.used && s.used[i]});
        // Of a view that is left out, all points say how far off it is.
        if (view.used && !s.used[i]) {
          ++o.dropped_points;
          continue;
        }
        sum += off[i].squaredNorm();
        ++used;
      }
      out.views[static_cast<std::size_t>(s.view)].rms_px[d] = std::sqrt(sum / std::max(1, used));
      if (view.used) own += sum, o.points += used;
    }
    o.rms_px = std::sqrt(own / std::max(1, o.points));
    squares += own, points += o.points;
    const double focal_sd = std::sqrt(o.covariance(0, 0)) / device.intrinsics[0];
    if (!(focal_sd < 0.1))
      throw Error(ErrorCode::too_little_data, words_for(observers[d]) +
                                                  ": saw boards that leave its focal length open (sd " +
                                                  std::to_string(std::lround(100 * focal_sd)) +
                                                  " %), wanted boards tilted by 20 to 40 deg, both ways");
    o.coverage = coverage_of(bundle, observers[d], static_cast<int>(d));
    o.ray_sd_px = ray_sd(device.intrinsics, o.covariance, observers[d].width, observers[d].height, o.coverage.points);
    out.observers.push_back(o);
  }
  out.rms_px = std::sqrt(squares / std::max(1, points));
  return out;
}

}  // namespace tribin
