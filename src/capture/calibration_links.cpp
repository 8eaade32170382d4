#include <algorithm>
#include <array>
#include <limits>

#include "capture/calibration_steps.hpp"
#include "tribin/core/error.hpp"

// The places of the observers to each other, from what each knows by itself.

namespace tribin::calibration_detail {
namespace {

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

Bundle join(const Board& board, std::span<const BoardObserver> observers, const std::vector<Bundle>& alone) {
  const std::size_t views = alone[0].rig_from_board.size();
  Bundle out;
  out.rig_from_board.assign(views, Pose::Identity());
  out.view_used.assign(views, 0);
  for (const Bundle& b : alone) out.devices.push_back(b.devices[0]);
  std::vector<char> linked(observers.size(), 0);
  std::vector<std::vector<int>> turns(observers.size(), std::vector<int>(views, 0));
  linked[0] = 1;
  const auto place_if_known = [&](std::size_t d) {
    if (observers[d].known) out.devices[d].rig_from_device = observers[d].known->rig_from_camera;
  };
  place_if_known(0);
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
    place_if_known(to);
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

}  // namespace tribin::calibration_detail
