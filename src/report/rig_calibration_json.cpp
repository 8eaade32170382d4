#include "tribin/report/rig_calibration_json.hpp"

#include <cmath>

#include "report/json_values.hpp"

namespace tribin {
namespace {

using json::Json;
using json::with;

std::string name_of(const BoardObserver& o) { return o.projector ? o.name : "camera " + o.name; }

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i)
    out += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return out;
}

constexpr const char* kNinths[9] = {"upper left", "upper middle", "upper right",  "left",       "middle",
                                    "right",      "lower left",   "lower middle", "lower right"};

/// Tilts of the board that are missing: 15 deg both ways about both axes make the focal length and the principal point.
std::string missing_tilts(const BoardCoverage& c) {
  constexpr double kEnough = 15 * kDegree;
  std::vector<std::string> words;
  if (c.tilt_x_most < kEnough) words.push_back("its upper edge away from it");
  if (c.tilt_x_least > -kEnough) words.push_back("its lower edge away from it");
  if (c.tilt_y_most < kEnough) words.push_back("its left edge away from it");
  if (c.tilt_y_least > -kEnough) words.push_back("its right edge away from it");
  return joined(words);
}

void warn_of_observer(const BoardObserver& seen, const ObserverCalibration& o, int views, std::vector<Warning>& out) {
  const std::string name = name_of(seen);
  if (views < 10)
    out.push_back({"few_views", name + with(": %.0f views of the board are in use; 10 to 20 are good.", views)});
  std::vector<std::string> empty;
  for (std::size_t k = 0; k < 9; ++k)
    if (o.coverage.points[k] == 0) empty.emplace_back(kNinths[k]);
  if (!empty.empty())
    out.push_back({"uncovered", name + ": no board in the " + joined(empty) +
                                    (seen.projector ? " of what it throws light on." : " of the picture.")});
  if (const std::string tilts = missing_tilts(o.coverage); !tilts.empty())
    out.push_back({"little_tilt", name + ": no view has the board tilted by 15 deg with " + tilts + "."});
  const double focal = std::sqrt(o.covariance(0, 0)) / o.camera.camera.fx;
  if (focal > 0.005)  // half a per cent of every depth
    out.push_back({"weak_focal_length", name + with(": the focal length is known to %.1f %% only (sd).", 100 * focal)});
  if (o.rms_px > 1)
    out.push_back({"large_residuals", name + with(": points are off by %.2f px (rms), where sharp pictures of a flat "
                                                  "board leave 0.1 to 0.3: blur, a bent board, or the wrong size.",
                                                  o.rms_px)});
  if (o.dropped_points > 0)
    out.push_back(
        {"dropped_points", name + with(": %.0f of %.0f points are off by more than 5 sigma: they are left out.",
                                       o.dropped_points, o.points + o.dropped_points)});
}

Json json_of(const BoardObserver& seen, const ObserverCalibration& o, bool first) {
  Json out;
  const PinholeCamera& c = o.camera.camera;
  out["name"] = o.camera.name;
  out["projector"] = seen.projector;
  out["width"] = c.width;
  out["height"] = c.height;
  out["K"] = {c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0};
  out["distortion"] = o.camera.distortion;
  out["rig_from_camera"] = json::pose(o.camera.rig_from_camera);
  out["sd"] = Json::object();
  Json open = Json::array();
  for (int i = 0; i < 9; ++i) {
    out["sd"][kIntrinsicNames[static_cast<std::size_t>(i)]] = json::significant(std::sqrt(o.covariance(i, i)));
    if (!o.held[static_cast<std::size_t>(i)]) open.push_back(kIntrinsicNames[static_cast<std::size_t>(i)]);
  }
  out["not_held"] = open;
  Json covariance = Json::array();
  for (int i = 0; i < 9; ++i) {
    Json row = Json::array();
    for (int j = 0; j < 9; ++j) row.push_back(json::significant(o.covariance(i, j)));
    covariance.push_back(row);
  }
  out["covariance"] = covariance;
  if (!first) {
    out["pose_covariance"] = json::matrix6(o.pose_covariance);
    out["sigma_mm"] = json::significant(std::sqrt(o.pose_covariance.topLeftCorner<3, 3>().trace()));
    out["sigma_deg"] = json::significant(std::sqrt(o.pose_covariance.bottomRightCorner<3, 3>().trace()) / kDegree);
  }
  out["rms_px"] = json::rounded(o.rms_px, 4);
  out["sigma_px"] = json::rounded(o.sigma_px, 4);
  out["points"] = o.points;
  out["dropped_points"] = o.dropped_points;
  out["ray_sd_px"] = Json::array();
  out["coverage"] = {{"points", Json::array()}};
  for (std::size_t r = 0; r < 3; ++r) {
    Json sd = Json::array(), points = Json::array();
    for (std::size_t k = 3 * r; k < 3 * r + 3; ++k) {
      sd.push_back(json::rounded(o.ray_sd_px[k], 3));
      points.push_back(o.coverage.points[k]);
    }
    out["ray_sd_px"].push_back(sd);
    out["coverage"]["points"].push_back(points);
  }
  const BoardCoverage& v = o.coverage;
  out["coverage"]["tilt_x_deg"] = {json::degrees(v.tilt_x_least), json::degrees(v.tilt_x_most)};
  out["coverage"]["tilt_y_deg"] = {json::degrees(v.tilt_y_least), json::degrees(v.tilt_y_most)};
  out["coverage"]["distance_mm"] = {json::millimetres(v.nearest_mm), json::millimetres(v.farthest_mm)};
  return out;
}

}  // namespace

Rig rig_of(const RigCalibrationReport& report) {
  Rig rig = report.known.value_or(Rig{});
  for (std::size_t i = 0; i < report.observers.size(); ++i) {
    const RigCamera& camera = report.result.observers[i].camera;
    if (report.observers[i].projector)
      rig.projector = camera;
    else if (!report.known)
      rig.cameras.push_back(camera);
  }
  return rig;
}

std::vector<Warning> rig_calibration_warnings(const RigCalibrationReport& report) {
  std::vector<Warning> out;
  for (const std::string& file : report.not_found)
    out.push_back({"board_not_found", file + ": no " + describe(report.board) + " was found."});
  for (std::size_t v = 0; v < report.ids.size(); ++v) {
    const BoardView& view = report.result.views[v];
    if (view.used) continue;
    std::vector<std::string> words;
    for (std::size_t i = 0; i < report.observers.size(); ++i)
      if (std::isfinite(view.rms_px[i]))
        words.push_back(with("%.2f px in ", view.rms_px[i]) + name_of(report.observers[i]));
    if (!words.empty())
      out.push_back(
          {"outlier_view", "View '" + report.ids[v] + "' does not fit the others (" + joined(words) +
                               "): it is left out. The board moved between pictures, or was not found rightly."});
  }
  for (std::size_t i = 0; i < report.observers.size(); ++i) {
    int views = 0;
    for (const BoardView& v : report.result.views) views += v.used && std::isfinite(v.rms_px[i]);
    if (report.observers[i].known) {
      // A calibration that fits leaves what the detector leaves: some tenths of a pixel.
      constexpr double kFits = 1;
      if (report.result.observers[i].rms_px > kFits)
        out.push_back({"known_camera_off", "The boards are " + with("%.2f px", report.result.observers[i].rms_px) +
                                               " off where the rig says that " + name_of(report.observers[i]) +
                                               " sees them: it was moved since; calibrate it anew."});
      continue;
    }
    warn_of_observer(report.observers[i], report.result.observers[i], views, out);
  }
  return out;
}

std::string rig_calibration_json(const RigCalibrationReport& report) {
  Json out = json::head();
  const Board& board = report.board;
  constexpr const char* kKinds[] = {"chessboard", "circles", "asymmetric_circles", "charuco"};
  out["board"] = {{"kind", kKinds[static_cast<int>(board.kind)]},
                  {"columns", board.columns},
                  {"rows", board.rows},
                  {"pitch_mm", board.pitch_mm}};
  out["rms_px"] = json::rounded(report.result.rms_px, 4);
  out["devices"] = Json::array();
  for (std::size_t i = 0; i < report.observers.size(); ++i)
    out["devices"].push_back(json_of(report.observers[i], report.result.observers[i], i == 0));
  out["views"] = Json::array();
  for (std::size_t v = 0; v < report.ids.size(); ++v) {
    const BoardView& view = report.result.views[v];
    Json rms = Json::object();
    for (std::size_t i = 0; i < report.observers.size(); ++i)
      if (std::isfinite(view.rms_px[i])) rms[report.observers[i].name] = json::rounded(view.rms_px[i], 4);
    Json entry = {{"id", report.ids[v]}, {"used", view.used && !rms.empty()}, {"rms_px", rms}};
    if (!rms.empty()) entry["rig_from_board"] = json::pose(view.rig_from_board);
    out["views"].push_back(entry);
  }
  out["not_found"] = report.not_found;
  out["warnings"] = json::warnings(rig_calibration_warnings(report), {});
  return json::text_of(out);
}

}  // namespace tribin
