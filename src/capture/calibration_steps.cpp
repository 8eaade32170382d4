#include "capture/calibration_steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/calibration_start.hpp"
#include "tribin/core/error.hpp"

namespace tribin::calibration_detail {
namespace {

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

/// The turn of the board about its middle that gives each point the place of turned_point.
Pose turn_of_board(const Board& board, int quarter_turns) {
  const std::vector<Vec3> points = board_points(board);
  const Vec3 middle = 0.5 * (points.front() + points.back());
  Pose out = Pose::Identity();
  out.linear() = rotation_from_vector(Vec3(0, 0, quarter_turns * kPi / 2));
  out.translation() = middle - out.linear() * middle;
  return out;
}

/// How far apart two poses put a board's corners [mm], mean.
double apart(const Pose& a, const Pose& b, const std::array<Vec3, 4>& corners) {
  double sum = 0;
  for (const Vec3& p : corners) sum += (a * p - b * p).norm();
  return sum / 4;
}

const Sight* sight_in(const Bundle& bundle, int view) {
  for (const Sight& s : bundle.sights)
    if (s.view == view) return &s;
  return nullptr;
}

/// The pose of one observer to another, and each view's turn, on which most views agree.
struct Link {
  Pose first_from_second = Pose::Identity();
  std::vector<int> turn;  ///< of each view of the second; 0 where they share none
  int shared = 0;
};

Link link(const Board& board, const Bundle& first, const Bundle& second) {
  const std::vector<int> turns = look_alike_turns(board);
  const std::vector<Vec3> points = board_points(board);
  const Vec3 far = points.back();
  const std::array<Vec3, 4> corners{Vec3(0, 0, 0), Vec3(far.x(), 0, 0), Vec3(0, far.y(), 0), far};
  struct Candidate {
    int view, turn;
    Pose first_from_second;
  };
  std::vector<std::vector<Candidate>> by_view;
  const int views = static_cast<int>(second.rig_from_board.size());
  for (int v = 0; v < views; ++v) {
    if (!sight_in(first, v) || !sight_in(second, v)) continue;
    by_view.emplace_back();
    for (int turn : turns)
      by_view.back().push_back(
          {v, turn,
           first.rig_from_board[static_cast<std::size_t>(v)] *
               (second.rig_from_board[static_cast<std::size_t>(v)] * turn_of_board(board, turn)).inverse()});
  }
  Link out;
  out.turn.assign(static_cast<std::size_t>(views), 0);
  out.shared = static_cast<int>(by_view.size());
  // Compared on the board itself: rotations and shifts in one unit, where it matters.
  const auto off = [&](const Pose& pose, const std::vector<Candidate>& other) {
    std::pair<double, int> best{std::numeric_limits<double>::max(), 0};
    for (const Candidate& c : other) {
      const Pose& board_pose = second.rig_from_board[static_cast<std::size_t>(c.view)];
      best = std::min(best, {apart(pose * board_pose, c.first_from_second * board_pose, corners), c.turn});
    }
    return best;
  };
  double least = std::numeric_limits<double>::max();
  for (const auto& view : by_view)
    for (const Candidate& c : view) {
      std::vector<double> all;
      for (const auto& other : by_view) all.push_back(off(c.first_from_second, other).first);
      const double middle = median(all);
      if (middle < least) least = middle, out.first_from_second = c.first_from_second;
    }
  for (const auto& view : by_view)
    out.turn[static_cast<std::size_t>(view[0].view)] = off(out.first_from_second, view).second;
  return out;
}

}  // namespace

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
  const double diagonal = std::hypot(observer.width, observer.height);
  const double corner = 0.5 * diagonal / device.intrinsics[0], square = corner * corner;
  device.prior_mean << 0, 0, 0.5 * (observer.width - 1), 0.5 * (observer.height - 1), 0, 0, 0, 0, 0;
  const double principal = observer.projector ? observer.height : 0.1 * diagonal;
  device.prior_sd << 0, 0, principal, principal, 0.3 / square, 0.1 / (square * square), 0.01 / corner, 0.01 / corner,
      0.01 / (square * square * square);
}

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

Bundle join(const Board& board, std::span<const BoardObserver> observers, const std::vector<Bundle>& alone) {
  const std::size_t views = alone[0].rig_from_board.size();
  Bundle out;
  out.rig_from_board.assign(views, Pose::Identity());
  out.view_used.assign(views, 0);
  for (const Bundle& b : alone) out.devices.push_back(b.devices[0]);
  std::vector<char> linked(observers.size(), 0);
  std::vector<std::vector<int>> turns(observers.size(), std::vector<int>(views, 0));
  linked[0] = 1;
  for (std::size_t done = 1; done < observers.size(); ++done) {
    // The strongest link next: most shared views.
    int most = 0;
    std::size_t from = 0, to = 0;
    for (std::size_t a = 0; a < observers.size(); ++a)
      for (std::size_t b = 0; b < observers.size(); ++b) {
        if (!linked[a] || linked[b]) continue;
        int shared = 0;
        for (std::size_t v = 0; v < views; ++v)
          shared += sight_in(alone[a], static_cast<int>(v)) && sight_in(alone[b], static_cast<int>(v));
        if (shared > most) most = shared, from = a, to = b;
      }
    if (most == 0) {
      const auto lone = std::find(linked.begin(), linked.end(), 0) - linked.begin();
      throw Error(ErrorCode::too_little_data, words_for(observers[static_cast<std::size_t>(lone)]) +
                                                  ": saw no view of the board that " + words_for(observers[0]) +
                                                  " has too, wanted " + std::to_string(kFewestViews) + " or more");
    }
    // The first one's numbers of the points, turned as its own link asks, count.
    Bundle reference = alone[from];
    for (std::size_t v = 0; v < views; ++v)
      reference.rig_from_board[v] = reference.rig_from_board[v] * turn_of_board(board, turns[from][v]);
    const Link l = link(board, reference, alone[to]);
    out.devices[to].rig_from_device = out.devices[from].rig_from_device * l.first_from_second;
    turns[to] = l.turn;
    linked[to] = 1;
  }
  std::vector<std::size_t> most(views, 0);
  for (std::size_t d = 0; d < observers.size(); ++d)
    for (const Sight& s : alone[d].sights) {
      const auto v = static_cast<std::size_t>(s.view);
      BoardSighting seen = observers[d].views[v];
      for (int& point : seen.point) point = turned_point(board, point, -turns[d][v]);
      out.sights.push_back(sight_of(board, seen, static_cast<int>(d), s.view));
      out.view_used[v] = 1;
      if (s.point.size() <= most[v]) continue;
      most[v] = s.point.size();
      out.rig_from_board[v] =
          out.devices[d].rig_from_device * alone[d].rig_from_board[v] * turn_of_board(board, turns[d][v]);
    }
  return out;
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
