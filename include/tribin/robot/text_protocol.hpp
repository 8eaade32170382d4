#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/kinematics/rotation_conventions.hpp"
#include "tribin/robot/link.hpp"
#include "tribin/robot/safety.hpp"

/// Poses for robot programs of any brand, as lines of text: the robot asks, tribin answers with a number, and poses in
/// the brand's own convention. docs/robot.md has the requests; examples/robots has programs that speak them.
namespace tribin::robot {

/// First field of each answer; stable.
enum class TextStatus {
  hello = 100,
  poses_follow = 200,
  scanned = 201,
  noted = 202,
  bin_empty = 204,
  no_object = 205,     ///< not empty, but no part was found
  not_pickable = 206,  ///< parts were found, and none may be picked
  unknown_request = 400,
  wrong_key = 401,
  wrong_fields = 402,  ///< their number, or one that is no number
  out_of_range = 403,
  no_such_pick = 404,
  unknown_convention = 405,
  hello_first = 409,
  scan_first = 410,     ///< there is no scan, or it is too old
  scene_changed = 411,  ///< a part was taken: scan again
  line_too_long = 413,
  vision_failed = 500,
  busy = 503,  ///< another robot program is served
};

/// What a robot is to do to take one part: before, at and after the pick; and to put it down, where that is planned.
struct TextPick {
  int id = 0;          ///< > 0, its own in the scene
  int part_class = 0;  ///< number of the part in the work cell, from 1
  std::array<Pose, 3> pick;
  std::vector<Pose> place;  ///< none or three
};

struct TextScene {
  TextStatus status = TextStatus::scanned;  ///< scanned, bin_empty, no_object, not_pickable
  std::vector<TextPick> picks;              ///< best first
};

/// What stands behind the protocol.
struct TextVision {
  std::function<TextScene()> scan;  ///< takes a scan and looks for parts
  std::function<void(int scene, const TextPick&, int result)>
      report{};  ///< 1 held, 2 missed, 3 lost on the way, 4 placed
};

struct TextOptions {
  std::string key{};    ///< that clients must show; empty = none
  SafetyLimits limits;  ///< workspace and forbidden boxes: poses elsewhere are not given out; greatest age of a scan
  bool rescan_after_pick = true;
};

/// Longest line, either way: what the strings of all brands hold.
inline constexpr std::size_t kLongestTextLine = 80;

/// One robot program. Bytes in, bytes out.
class TextSession {
 public:
  TextSession(TextVision vision, TextOptions options, Clock& clock)
      : vision_(std::move(vision)), options_(std::move(options)), clock_(clock) {}
  std::string receive(std::string_view bytes);
  /// After BYE, a wrong key, or a line without end.
  bool over() const { return over_; }

 private:
  std::string answer(const std::string& line);
  std::string hello(const std::vector<std::string>& fields);
  std::string scan();
  std::string get(const std::vector<std::string>& fields);
  std::string place(const std::vector<std::string>& fields);
  std::string done(const std::vector<std::string>& fields);
  std::string say(TextStatus status, const std::string& rest = {}) const;
  std::string pose_line(const TextPick& pick, int step, const Pose& pose) const;
  const TextPick* find(int id) const;
  bool scan_is_usable() const;

  TextVision vision_;
  TextOptions options_;
  Clock& clock_;
  std::string buffer_;
  bool greeted_ = false, over_ = false;
  Convention convention_ = Convention::yaskawa;
  int scene_ = 0;
  double scan_time_s_ = 0;
  bool changed_ = false;
  TextScene now_;
  std::size_t next_ = 0;  ///< of the picks that were not given out
};

/// Serves one robot program at a time on a TCP port, in a thread of its own; others are told that it is busy.
class TextServer {
 public:
  /// \throws Error device where the port is taken or may not be opened (see RefusalCode::not_loopback).
  TextServer(TextVision vision, TextOptions options, const std::string& address, int port, ByteSink sink = {});
  ~TextServer();
  TextServer(const TextServer&) = delete;
  TextServer& operator=(const TextServer&) = delete;
  int port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::robot
