#include <cmath>

#include "io/pose_json.hpp"
#include "tribin/picking/report.hpp"

namespace tribin::picking {
namespace {

double rounded(double value, double steps) { return std::round(value * steps) / steps; }

}  // namespace

std::string line_of(const CycleReport& report) {
  nlohmann::ordered_json json;
  json["state"] = report.state;
  json["scene"] = report.scene;
  if (report.cycle) json["cycle"] = report.cycle;
  if (report.arm) json["arm"] = report.arm;
  if (!report.part.empty()) {
    json["part"] = report.part;
    json["gripper"] = report.gripper;
  }
  if (!report.grasp.empty()) {
    json["grasp"] = report.grasp;
    json["slot"] = report.slot;
    json["resort"] = name_of(report.resort);
    json["score"] = rounded(report.score, 1e4);
    for (const grasp::Term& term : report.terms) json["terms"][term.name] = rounded(term.value, 1e4);
    json["base_from_part"] = io::json_of(report.base_from_part);
    json["base_from_tcp"] = io::json_of(report.base_from_tcp);
  }
  if (report.in_hand) {
    nlohmann::ordered_json& in_hand = json["in_hand"];
    in_hand["measured"] = report.in_hand->measured;
    in_hand["sigma_mm"] = rounded(report.in_hand->sigma_mm, 1e3);
    if (report.in_hand->measured) {
      in_hand["moved_mm"] = rounded(report.in_hand->moved_mm, 1e3);
      in_hand["moved_deg"] = rounded(report.in_hand->moved / kDegree, 1e3);
    }
    if (!report.in_hand->why.empty()) in_hand["why"] = report.in_hand->why;
  }
  json["seen"] = nlohmann::ordered_json::object();
  for (const auto& [part, count] : report.seen) json["seen"][part] = count;
  json["refused"] = nlohmann::ordered_json::object();
  for (const grasp::WhyCount& reason : report.refused) json["refused"][name_of(reason.why)] = reason.count;
  json["stages_ms"] = {{"find", rounded(report.find_ms, 10)}, {"plan", rounded(report.plan_ms, 10)}};
  json["robot_s"] = rounded(report.robot_s, 100);
  if (!report.note.empty()) json["note"] = report.note;
  return json.dump();
}

std::string line_of(const RunEnd& end, const Filling& filling) {
  nlohmann::ordered_json json;
  json["status"] = end.status;
  json["message"] = end.message;
  json["placed"] = end.placed;
  json["rack"] = filling;
  return json.dump();
}

}  // namespace tribin::picking
