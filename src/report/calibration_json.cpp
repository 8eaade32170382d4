#include "tribin/report/calibration_json.hpp"

#include <cmath>

#include "report/json_values.hpp"
#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin {
namespace {

using json::Json;
using json::with;

/// A pose with the same rotation as a cell file takes it (interfaces.md, section 7).
Json cell_pose(const Pose& pose) {
  Json out = json::pose(pose);
  const Vec3 angles = robot::yaskawa_from_rotation(Matrix3(pose.linear()));
  out["rotation_deg"] = {
      {"convention", "yaskawa"},
      {"values", {json::rounded(angles.x(), 6), json::rounded(angles.y(), 6), json::rounded(angles.z(), 6)}}};
  return out;
}

}  // namespace

std::vector<Warning> hand_eye_warnings(const HandEyeFile& file, const HandEye& result) {
  std::vector<Warning> out;
  const auto id = [&](int i) { return "'" + file.pairs[i].id + "'"; };
  for (const auto& [i, j] : result.swapped)
    out.push_back({"swapped_pairs", "The camera poses of " + id(i) + " and " + id(j) +
                                        " are swapped: each fits the other's robot pose. Both are left out."});
  for (int i : result.outliers) {
    const HandEyeResidual& r = result.pairs[i];
    bool swapped = false;
    for (const auto& [a, b] : result.swapped) swapped = swapped || a == i || b == i;
    if (swapped) continue;
    if (r.fits_camera_of >= 0)
      out.push_back({"wrong_pair", "The robot pose of " + id(i) + " fits the camera pose of " + id(r.fits_camera_of) +
                                       ", not its own. It is left out."});
    else
      out.push_back({"outlier", "Pair " + id(i) +
                                    with(" is off by %.2f mm and %.3f deg, %.0f sigma: it is left out.", r.error_mm,
                                         r.error_rad / kDegree, r.deviation)});
  }
  for (const auto& [ids, what] : {std::pair{&file.robot_only, "robot pose has no camera pose"},
                                  {&file.camera_only, "camera pose has no robot pose"}})
    for (const std::string& name : *ids) out.push_back({"unpaired", "'" + name + "': the " + what + "."});
  if (result.nearly_parallel_axes)
    out.push_back({"nearly_parallel_axes",
                   with("The axes of the robot's turns lie %.1f deg apart: along their common direction the place is "
                        "held badly. Tilt the flange both ways by 15 deg or more.",
                        result.axis_spread_rad / kDegree)});
  if (result.noisier_than_stated)
    out.push_back({"noisier_than_stated",
                   with("The residuals are %.1f times as large as the stated noise: the covariance is scaled to them.",
                        std::sqrt(result.variance_factor))});
  const double used = static_cast<double>(file.pairs.size() - result.outliers.size());
  const double good = file.target == HandEyeTarget::board ? 12 : 20, enough_to_tell = good == 12 ? 6 : 8;
  if (used < good)
    out.push_back({"few_pairs", with("%.0f pairs are in use; %.0f or more are good", used, good) +
                                    (static_cast<double>(file.pairs.size()) < enough_to_tell
                                         ? with(", and below %.0f a wrong one cannot be told.", enough_to_tell)
                                         : std::string("."))});
  return out;
}

std::vector<Warning> touch_warnings(const TouchResult& result) {
  std::vector<Warning> out;
  if (result.rigid_error)
    out.push_back({"rigid_error",
                   with("A shift and turn of %.3f deg take the error from %.2f to %.2f mm: calibrate hand-eye again.",
                        result.rotation_rad / kDegree, result.rms_mm, result.residual_rms_mm)});
  if (result.scale_error)
    out.push_back({"scale_error",
                   with("Lengths are touched %.5f (sigma %.5f) times as long as seen: the camera's own calibration is "
                        "off, or the tip's length is wrong.",
                        result.scale, result.scale_sigma)});
  if (result.error_mm.size() < 8)
    out.push_back({"few_points", with("%.0f points were touched; 8 to 12 spread over the workspace are good.",
                                      static_cast<double>(result.error_mm.size()))});
  return out;
}

std::string hand_eye_json(const HandEyeFile& file, CameraMount mount, const HandEye& result) {
  const bool fixed = mount == CameraMount::fixed, sphere = file.target == HandEyeTarget::sphere;
  Json out = json::head();
  out["mount"] = fixed ? "fixed" : "hand";
  out["target"] = sphere ? "sphere" : "board";
  out[fixed ? "base_from_camera" : "flange_from_camera"] = cell_pose(result.parent_from_camera);
  const Vec3 target = result.holder_from_target.translation();
  const char* holder = fixed ? "flange_from_target" : "base_from_target";
  out[holder] = sphere ? Json{{"translation_mm", json::millimetres(target)}} : json::pose(result.holder_from_target);
  out["covariance"] = json::matrix6(result.covariance);
  out["sigma_mm"] = json::significant(result.sigma_mm);
  out["sigma_deg"] = json::significant(result.sigma_rad / kDegree);
  out["sigma_at_targets_mm"] = json::significant(result.sigma_at_targets_mm);
  out["variance_factor"] = json::significant(result.variance_factor);
  out["pairs_used"] = file.pairs.size() - result.outliers.size();
  out["rms_mm"] = json::millimetres(result.rms_mm);
  out["rms_deg"] = json::degrees(result.rms_rad);
  out["leave_one_out_rms_mm"] = json::millimetres(result.left_out_rms_mm);
  out["leave_one_out_rms_deg"] = json::degrees(result.left_out_rms_rad);
  out["axis_spread_deg"] = json::degrees(result.axis_spread_rad);
  out["pairs"] = Json::array();
  for (std::size_t i = 0; i < result.pairs.size(); ++i) {
    const HandEyeResidual& r = result.pairs[i];
    Json pair = {{"id", file.pairs[i].id},
                 {"used", r.used},
                 {"error_mm", json::millimetres(r.error_mm)},
                 {"error_deg", json::degrees(r.error_rad)},
                 {"deviation_sigma", json::significant(r.deviation)},
                 {"leave_one_out_mm", json::millimetres(r.left_out_mm)},
                 {"leave_one_out_deg", json::degrees(r.left_out_rad)}};
    if (r.fits_camera_of >= 0) pair["fits_camera_of"] = file.pairs[r.fits_camera_of].id;
    out["pairs"].push_back(std::move(pair));
  }
  out["swapped"] = Json::array();
  for (const auto& [i, j] : result.swapped) out["swapped"].push_back({file.pairs[i].id, file.pairs[j].id});
  out["outliers"] = Json::array();
  for (int i : result.outliers) out["outliers"].push_back(file.pairs[i].id);
  out["unpaired"] = {{"robot", file.robot_only}, {"camera", file.camera_only}};
  out["warnings"] = json::warnings(hand_eye_warnings(file, result), {});
  return json::text_of(out);
}

std::string touch_json(const TouchFile& file, const std::string& date, const TouchResult& result) {
  Json out = json::head();
  out["date"] = date;
  out["rms_mm"] = json::millimetres(result.rms_mm);
  out["max_mm"] = json::millimetres(result.max_mm);
  out["mean_error_mm"] = json::millimetres(result.mean_error_mm);
  out["touched_from_predicted"] = cell_pose(result.touched_from_predicted);
  out["rotation_deg"] = json::degrees(result.rotation_rad);
  out["residual_rms_mm"] = json::millimetres(result.residual_rms_mm);
  out["residual_sigma_mm"] = json::millimetres(result.residual_sigma_mm);
  out["scale"] = json::significant(result.scale);
  out["scale_sigma"] = json::significant(result.scale_sigma);
  out["points"] = Json::array();
  for (std::size_t i = 0; i < file.points.size(); ++i)
    out["points"].push_back({{"id", file.points[i].id},
                             {"predicted_mm", json::millimetres(file.points[i].predicted_mm)},
                             {"touched_mm", json::millimetres(file.points[i].touched_mm)},
                             {"error_mm", json::millimetres(result.error_mm[i])},
                             {"distance_mm", json::millimetres(result.error_mm[i].norm())},
                             {"residual_mm", json::millimetres(result.residual_mm[i])}});
  out["regions"] = Json::array();
  for (const TouchRegion& region : result.regions) {
    Json ids = Json::array();
    for (int i : region.points) ids.push_back(file.points[i].id);
    out["regions"].push_back({{"min_mm", json::millimetres(region.min_mm)},
                              {"max_mm", json::millimetres(region.max_mm)},
                              {"points", ids},
                              {"mean_error_mm", json::millimetres(region.mean_error_mm)},
                              {"rms_mm", json::millimetres(region.rms_mm)}});
  }
  out["warnings"] = json::warnings(touch_warnings(result), {});
  return json::text_of(out);
}

}  // namespace tribin
