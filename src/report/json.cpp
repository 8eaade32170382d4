#include "tribin/report/json.hpp"

#include "report/json_values.hpp"

namespace tribin {
namespace {

using json::Json;

Json evidence_json(const Evidence& e) {
  Json out = {{"primitive", e.primitive}, {"type", name_of(e.type)}, {"cad_primitive", e.cad_primitive}};
  if (e.scan_primitive > 0) out["scan_primitive"] = e.scan_primitive;
  if (e.visible_arc > 0) out["visible_arc_deg"] = json::degrees(e.visible_arc);
  out["inliers"] = e.inliers;
  out["rms_mm"] = json::rounded(e.rms_mm, 5);
  if (e.radius_nominal_mm) {
    Json radius = {{"nominal", json::millimetres(*e.radius_nominal_mm)}};
    if (e.radius_measured_mm) radius["measured"] = json::millimetres(*e.radius_measured_mm);
    if (e.radius_sigma_mm) radius["sigma"] = json::significant(*e.radius_sigma_mm);
    out["radius_mm"] = radius;
  }
  if (e.offset_mm) {
    out["offset_mm"] = {{"measured", json::millimetres(*e.offset_mm)}};
    if (e.offset_sigma_mm) out["offset_mm"]["sigma"] = json::significant(*e.offset_sigma_mm);
  }
  for (const TestResult& test : e.tests)
    out["tests"].push_back({{"test", test.test},
                            {"value", json::significant(test.value)},
                            {"limit", json::significant(test.limit)},
                            {"wanted", test.at_least ? "at_least" : "at_most"},
                            {"passed", test.passed}});
  return out;
}

/// Lengths in mm, angles in degrees: the keys say which.
Json dimension_json(const Dimension& d) {
  const double unit = d.is_angle ? kDegree : 1;
  const std::string suffix = d.is_angle ? "_deg" : "_mm";
  Json out = {{"name", d.name}, {"kind", d.kind}, {"cad_primitives", Json::array({d.first})}};
  if (d.second > 0) out["cad_primitives"].push_back(d.second);
  out["nominal" + suffix] = json::rounded(d.nominal / unit, 5);
  out["measured" + suffix] = json::rounded(d.measured / unit, 5);
  out["sigma" + suffix] = json::significant(d.sigma / unit);
  out["tolerance" + suffix] = json::rounded(d.tolerance / unit, 5);
  out["deviates"] = d.deviates;
  return out;
}

Json quality_json(const Quality& quality) {
  Json out = {{"decision", name_of(quality.decision)},
              {"reasons", Json::array()},
              {"checked_fraction", json::rounded(quality.checked_fraction, 4)},
              {"dimensions", Json::array()},
              {"deviations", Json::array()}};
  for (const std::string& reason : quality.reasons) out["reasons"].push_back(reason);
  for (const Dimension& d : quality.dimensions) out["dimensions"].push_back(dimension_json(d));
  for (const Deviation& d : quality.deviations) {
    Json entry = {{"kind", d.kind}};
    if (d.primitive > 0) entry["cad_primitive"] = d.primitive;
    entry["at_part_mm"] = json::millimetres(d.at_part_mm);
    entry["area_mm2"] = json::rounded(d.area_mm2, 1);
    entry["depth_mm"] = json::rounded(d.depth_mm, 4);
    entry["sigma_mm"] = json::significant(d.sigma_mm);
    out["deviations"].push_back(entry);
  }
  return out;
}

Json direction_json(const Vector6& direction) {
  Json out = Json::array();
  for (int i = 0; i < 6; ++i) out.push_back(json::rounded(direction[i], 9));
  return out;
}

Json instance_json(const Instance& instance, const Pose& input_from_camera) {
  const Matrix3 turn = input_from_camera.linear();
  Json out = {{"id", instance.id},
              {"part", instance.part},
              {"score", json::rounded(instance.score, 4)},
              {"visible_fraction", json::rounded(instance.visible_fraction, 4)}};
  if (instance.p_within_tolerance) out["p_within_tolerance"] = json::rounded(*instance.p_within_tolerance, 4);
  out["camera_from_part"] = json::pose(input_from_camera * instance.camera_from_part);
  out["covariance"] = json::matrix6(json::turned(instance.covariance, turn));
  out["free_directions"] = Json::array();
  for (const Vector6& direction : instance.free_directions)
    out["free_directions"].push_back(direction_json(json::turned(direction, turn)));
  out["weak_directions"] = Json::array();
  for (const WeakDirection& weak : instance.weak_directions)
    out["weak_directions"].push_back({{"direction", direction_json(json::turned(weak.direction, turn))},
                                      {"sigma_mm", json::significant(weak.sigma_mm)},
                                      {"sigma_deg", json::significant(weak.sigma / kDegree)},
                                      {"cure", weak.cure}});
  out["equivalent_poses"] = Json::array();
  for (const Pose& pose : instance.equivalent_poses)
    out["equivalent_poses"].push_back(json::pose(input_from_camera * pose));
  out["alternatives"] = Json::array();
  for (const Alternative& alternative : instance.alternatives) {
    Json entry = json::pose(input_from_camera * alternative.camera_from_part);
    entry["probability"] = json::rounded(alternative.probability, 4);
    entry["decided_by"] = alternative.decided_by;
    out["alternatives"].push_back(entry);
  }
  out["evidence"] = Json::array();
  for (const Evidence& evidence : instance.evidence) out["evidence"].push_back(evidence_json(evidence));
  out["quality"] = quality_json(instance.quality);
  return out;
}

Json reason_json(const Reason& reason, const Pose& input_from_camera) {
  Json out = {{"part", reason.part},
              {"stage", reason.stage},
              {"test", reason.test},
              {"value", json::significant(reason.value)},
              {"limit", json::significant(reason.limit)},
              {"count", reason.count}};
  if (reason.at_mm) {
    out["nearest"]["instance"] = reason.nearest_instance > 0 ? Json(reason.nearest_instance) : Json();
    out["nearest"]["at_mm"] = json::millimetres(Vec3(input_from_camera * *reason.at_mm));
  }
  return out;
}

/// What stands in it when the bin is found, and why it is not.
Json bin_json(const BinSighting& bin, const Pose& input_from_camera) {
  if (!bin.found) return {{"found", false}, {"reason", bin.reason}};
  Json out = {{"camera_from_bin", json::pose(input_from_camera * bin.camera_from_bin)},
              {"found", true},
              {"fill", json::rounded(bin.fill, 4)}};
  if (bin.drift_sigma) {
    out["drift_sigma"] = json::rounded(*bin.drift_sigma, 2);
    out["drift_mm"] = json::rounded(bin.drift_mm, 3);
    out["drift_deg"] = json::rounded(bin.drift_rad / kDegree, 4);
  }
  return out;
}

Json region_json(const UnexplainedRegion& region, const Pose& input_from_camera) {
  return {{"center_mm", json::millimetres(Vec3(input_from_camera * region.center_mm))},
          {"volume_mm3", json::rounded(region.volume_mm3, 1)},
          {"pixels", region.pixels}};
}

}  // namespace

std::string locate_json(const Scan& scan, const Found& found, const JsonOptions& options) {
  Json out = json::head();
  out["status"] = found.status;
  out["scan"] = json::scan_summary(scan, &found.surfels);
  out["instances"] = Json::array();
  for (const Instance& instance : found.instances.items)
    out["instances"].push_back(instance_json(instance, scan.input_from_camera));
  out["uncertain"] = Json::array();
  for (const Instance& instance : found.instances.uncertain)
    out["uncertain"].push_back(instance_json(instance, scan.input_from_camera));
  out["rejected"] = Json::array();
  for (const Reason& reason : found.instances.rejected)
    out["rejected"].push_back(reason_json(reason, scan.input_from_camera));
  out["primitives"] = json::counts(found.primitives.items);
  if (found.bin) out["bin"] = bin_json(*found.bin, scan.input_from_camera);
  out["unexplained"] = Json::array();
  for (const UnexplainedRegion& region : found.instances.unexplained)
    out["unexplained"].push_back(region_json(region, scan.input_from_camera));
  out["work_done"] = found.instances.work_done;
  out["warnings"] = json::warnings(found.warnings, scan.warnings);
  if (options.times) out["stages_ms"] = json::stages(found.times);
  return json::text_of(out);
}

std::string segment_json(const Surfels& surfels, const Primitives& primitives, const PrimitiveModel& model,
                         const StageTimes& times, const std::vector<Warning>& warnings, const JsonOptions& options) {
  const Pose frame = surfels.scan != nullptr ? surfels.scan->input_from_camera : Pose::Identity();
  Json out = json::head();
  out["scan"] = surfels.scan != nullptr ? json::scan_summary(*surfels.scan, &surfels) : json::cloud_summary(surfels);
  out["primitives"] = Json::array();
  for (const Primitive& primitive : primitives.items)
    out["primitives"].push_back(json::primitive(json::moved(primitive, frame), &primitives.spaces));
  out["relations"] = Json::array();
  for (const Relation& relation : model.relations) out["relations"].push_back(json::relation(relation, frame));
  out["warnings"] =
      json::warnings(warnings, surfels.scan != nullptr ? surfels.scan->warnings : surfels.point_set->warnings);
  if (options.times) out["stages_ms"] = json::stages(times);
  return json::text_of(out);
}

}  // namespace tribin
