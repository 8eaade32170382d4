#include "capture/calibration_steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/calibration_start.hpp"
#include "tribin/core/error.hpp"

namespace tribin::calibration_detail {
namespace {

/// Distances of a sight's points from where they should be, of those in use or of all.
std::vector<double> distances(const Bundle& bundle, const Sight& sight) {
  std::vector<double> out;
  for (const Vec2& r : residuals(bundle, sight))
    out.push_back(std::isfinite(r.x()) ? r.norm() : std::numeric_limits<double>::max());
  return out;
}

/// The median distance of a Gaussian in the plane, in sd of one coordinate.
const double kMedianRadius = std::sqrt(2 * std::log(2.0));
/// No detector is better: keeps perfect data from dividing by nothing.
constexpr double kLeastSigma = 1e-3;

/// Views by how far off they are against the median view of each device.
std::vector<char> good_views(const Bundle& bundle) {
  std::vector<std::vector<double>> of_device(bundle.devices.size());
  std::vector<double> off;
  for (const Sight& s : bundle.sights) {
    off.push_back(std::max(median(distances(bundle, s)), kLeastSigma));
    of_device[static_cast<std::size_t>(s.device)].push_back(off.back());
  }
  std::vector<char> out(bundle.view_used.size(), 0);
  for (const Sight& s : bundle.sights) out[static_cast<std::size_t>(s.view)] = 1;
  for (std::size_t i = 0; i < bundle.sights.size(); ++i) {
    const Sight& s = bundle.sights[i];
    if (off[i] > kOutlierView * median(of_device[static_cast<std::size_t>(s.device)]))
      out[static_cast<std::size_t>(s.view)] = 0;
  }
  return out;
}

void need_views(const Bundle& bundle, std::span<const BoardObserver> observers) {
  for (std::size_t d = 0; d < observers.size(); ++d) {
    int used = 0, seen = 0;
    for (const Sight& s : bundle.sights) {
      if (s.device != static_cast<int>(d)) continue;
      ++seen;
      used += bundle.view_used[static_cast<std::size_t>(s.view)] != 0;
    }
    if (used >= kFewestViews) continue;
    throw Error(ErrorCode::too_little_data, words_for(observers[d]) + ": saw " + std::to_string(used) +
                                                (used == seen ? used == 1 ? " view of the board" : " views of the board"
                                                              : " of " + std::to_string(seen) + " views that agree") +
                                                ", wanted " + std::to_string(kFewestViews) +
                                                " at least; 10 to 20 are good");
  }
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Sight sight_of(const Board& board, const BoardSighting& seen, int device, int view) {
  const std::vector<Vec3> points = board_points(board);
  Sight out{device, view, {}, seen.pixel, std::vector<char>(seen.pixel.size(), 1)};
  for (int i : seen.point) out.point.push_back(points[static_cast<std::size_t>(i)]);
  return out;
}

std::string words_for(const BoardObserver& observer) {
  if (observer.projector) return "the projector";
  return observer.name.empty() ? "the camera" : "camera " + observer.name;
}

double robust_sigma(const Bundle& bundle, int device) {
  std::vector<double> all;
  for (const Sight& s : bundle.sights) {
    if (s.device != device || !bundle.view_used[static_cast<std::size_t>(s.view)]) continue;
    const std::vector<double> off = distances(bundle, s);
    all.insert(all.end(), off.begin(), off.end());
  }
  return std::max(median(all) / kMedianRadius, kLeastSigma);
}

void set_priors(Device& device, const BoardObserver& observer) {
  if (device.fixed) return;
  const double diagonal = std::hypot(observer.width, observer.height);
  const double corner = 0.5 * diagonal / device.intrinsics[0], square = corner * corner;
  device.prior_mean << 0, 0, 0.5 * (observer.width - 1), 0.5 * (observer.height - 1), 0, 0, 0, 0, 0;
  const double principal = observer.projector ? observer.height : 0.1 * diagonal;
  device.prior_sd << 0, 0, principal, principal, 0.3 / square, 0.1 / (square * square), 0.01 / corner, 0.01 / corner,
      0.01 / (square * square * square);
}

namespace {

/// The boards before a device that is known.
Bundle place_boards(Bundle bundle, const std::vector<Eigen::Matrix3d>& homographies, const BoardObserver& observer) {
  const PinholeCamera& c = observer.known->camera;
  const Distortion& d = observer.known->distortion;
  Device& device = bundle.devices[0];
  device.fixed = true;
  device.intrinsics << c.fx, c.fy, c.cx, c.cy, d[0], d[1], d[2], d[3], d[4];
  for (std::size_t i = 0; i < bundle.sights.size(); ++i)
    bundle.rig_from_board[static_cast<std::size_t>(bundle.sights[i].view)] =
        pose_of_homography(homographies[i], c.fx, {c.cx, c.cy});
  refine(bundle, Loss::huber, 20);
  settle(bundle, {&observer, 1});
  return bundle;
}

}  // namespace

Bundle calibrate_alone(const Board& board, const BoardObserver& observer) {
  const std::size_t views = observer.views.size();
  Bundle start;
  start.devices.resize(1);
  start.rig_from_board.assign(views, Pose::Identity());
  start.view_used.assign(views, 0);
  std::vector<Eigen::Matrix3d> homographies;
  for (std::size_t v = 0; v < views; ++v) {
    const BoardSighting& seen = observer.views[v];
    if (seen.point.empty()) continue;
    Sight sight = sight_of(board, seen, 0, static_cast<int>(v));
    const std::optional<Eigen::Matrix3d> h = homography_of(sight.point, sight.pixel);
    // A pose takes six of a sight's numbers: five points and more leave something to adjust.
    if (!h || seen.point.size() < 6) continue;
    homographies.push_back(*h);
    start.sights.push_back(std::move(sight));
    start.view_used[v] = 1;
  }
  need_views(start, {&observer, 1});
  if (observer.known) return place_boards(std::move(start), homographies, observer);
  // A camera's principal point is near the middle; a projector throws upwards or downwards.
  std::vector<Vec2> principals{Vec2(0.5 * (observer.width - 1), 0.5 * (observer.height - 1))};
  if (observer.projector)
    for (double y : {0.0, 1.0}) principals.emplace_back(principals[0].x(), y * (observer.height - 1));
  double least = std::numeric_limits<double>::infinity();
  Bundle best;
  for (const Vec2& principal : principals) {
    // The closed form, and where the views hardly tell, lenses from wide to long.
    std::vector<double> focals{0.7, 1.5, 4.0};
    for (double& f : focals) f *= observer.width;
    if (const std::optional<double> f = focal_of(homographies, principal)) focals.push_back(*f);
    for (const double focal : focals) {
      Bundle trial = start;
      trial.devices[0].intrinsics << focal, focal, principal.x(), principal.y(), 0, 0, 0, 0, 0;
      set_priors(trial.devices[0], observer);
      for (std::size_t i = 0; i < trial.sights.size(); ++i)
        trial.rig_from_board[static_cast<std::size_t>(trial.sights[i].view)] =
            pose_of_homography(homographies[i], focal, principal);
      const double cost = refine(trial, Loss::huber, 20);
      if (cost < least) least = cost, best = std::move(trial);
    }
  }
  if (!std::isfinite(least))
    throw Error(ErrorCode::too_little_data,
                words_for(observer) + ": saw boards that no lens fits, wanted points in the order of the board");
  set_priors(best.devices[0], observer);
  settle(best, {&observer, 1});
  return best;
}

void settle(Bundle& bundle, std::span<const BoardObserver> observers) {
  const auto set_sigmas = [&] {
    for (std::size_t d = 0; d < bundle.devices.size(); ++d)
      bundle.devices[d].sigma = robust_sigma(bundle, static_cast<int>(d));
  };
  bundle.view_used = good_views(bundle);
  need_views(bundle, observers);
  set_sigmas();
  constexpr int kMostRounds = 20;  // views that come and go in turn would go on for ever
  for (int round = 0; round < kMostRounds; ++round) {
    refine(bundle, Loss::huber);
    set_sigmas();
    const std::vector<char> good = good_views(bundle);
    if (good == bundle.view_used) break;
    bundle.view_used = good;
    need_views(bundle, observers);
  }
  // Beyond 5 sigma: one point in 270,000 of Gaussian noise.
  constexpr double kOutlierPoint = 5;
  for (int round = 0; round < 3; ++round) {
    for (Sight& s : bundle.sights) {
      const std::vector<double> off = distances(bundle, s);
      const double limit = kOutlierPoint * bundle.devices[static_cast<std::size_t>(s.device)].sigma;
      for (std::size_t i = 0; i < off.size(); ++i) s.used[i] = off[i] <= limit;
    }
    refine(bundle, Loss::squares);
    set_sigmas();
  }
}

}  // namespace tribin::calibration_detail
