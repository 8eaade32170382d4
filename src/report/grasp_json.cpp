#include "tribin/report/grasp_json.hpp"

#include "report/json_values.hpp"

namespace tribin {
namespace {

using grasp::Why;
using json::Json;

Json path_json(const std::vector<grasp::PathPoint>& path, const grasp::Scene& scene) {
  Json out = Json::array();
  for (const grasp::PathPoint& point : path) {
    Json entry = {{"step", name_of(point.step)}, {"base_from_tcp", json::pose(point.base_from_tcp)}};
    if (scene.arm) {
      entry["joints_deg"] = Json::array();
      for (int i = 0; i < scene.arm->arm->axes(); ++i) entry["joints_deg"].push_back(json::degrees(point.joints[i]));
    }
    out.push_back(std::move(entry));
  }
  return out;
}

Json terms_json(const std::vector<grasp::Term>& terms) {
  Json out = Json::object();
  for (const grasp::Term& term : terms) out[term.name] = json::rounded(term.value, 4);
  return out;
}

Json refused_json(const std::vector<grasp::RefusedGrasp>& refused, const grasp::Scene& scene) {
  Json out = Json::array();
  for (const grasp::RefusedGrasp& r : refused) {
    const grasp::PartHere& part = scene.parts[r.part];
    out.push_back({{"instance", part.id},
                   {"part", part.part->part->name},
                   {"gripper", r.gripper},
                   {"family", r.family},
                   {"reason", name_of(r.why)},
                   {"value", json::rounded(in_unit(r.why, r.value), 4)},
                   {"limit", json::rounded(in_unit(r.why, r.limit), 4)},
                   {"unit", unit_of(r.why)}});
  }
  return out;
}

Json reasons_json(const std::vector<grasp::WhyCount>& reasons) {
  Json out = Json::array();
  for (const grasp::WhyCount& r : reasons) out.push_back({{"reason", name_of(r.why)}, {"count", r.count}});
  return out;
}

Json grasp_json(const grasp::Grasp& g, const grasp::Scene& scene) {
  return {{"instance", g.id},
          {"part", g.part_name},
          {"gripper", g.gripper},
          {"family", g.family},
          {"score", json::rounded(g.score, 4)},
          {"terms", terms_json(g.terms)},
          {"opening_before_mm", json::millimetres(g.opening_before_mm)},
          {"opening_mm", json::millimetres(g.opening_mm)},
          {"clearance_mm", json::millimetres(g.clearance_mm)},
          {"sigma_mm", json::millimetres(g.sigma_mm)},
          {"part_from_tcp", json::pose(g.part_from_tcp)},
          {"path", path_json(g.path, scene)}};
}

Json push_json(const grasp::Push& p, const grasp::Scene& scene) {
  return {{"instance", p.id},
          {"part", p.part_name},
          {"gripper", p.gripper},
          {"length_mm", json::millimetres(p.length_mm)},
          {"score", json::rounded(p.score, 4)},
          {"terms", terms_json(p.terms)},
          {"path", path_json(p.path, scene)}};
}

}  // namespace

std::string_view unit_of(Why why) {
  switch (why) {
    case Why::confidence:
    case Why::covered:
    case Why::hold:
    case Why::reach:
    case Why::place:
      return "";
    case Why::approach_angle:
    case Why::form:
      return "deg";
    default:
      return "mm";
  }
}

double in_unit(Why why, double value) { return unit_of(why) == "deg" ? value / kDegree : value; }

std::string grasps_json(const grasp::Scene& scene, const grasp::Plan& plan, const grasp::PushPlan* pushes,
                        const std::vector<std::string>& warnings) {
  Json out = json::head();
  out["status"] = !plan.grasps.empty() ? "ok" : scene.parts.empty() ? "no_object" : "not_pickable";
  out["parts"] = scene.parts.size();
  out["grasps"] = Json::array();
  for (const grasp::Grasp& g : plan.grasps) out["grasps"].push_back(grasp_json(g, scene));
  out["reasons"] = reasons_json(plan.reasons);
  out["refused"] = refused_json(plan.refused, scene);
  out["not_looked_at"] = plan.not_looked_at;
  if (pushes) {
    out["pushes"] = Json::array();
    for (const grasp::Push& p : pushes->pushes) out["pushes"].push_back(push_json(p, scene));
    out["push_reasons"] = reasons_json(pushes->reasons);
  }
  std::vector<std::string> all = plan.warnings;
  all.insert(all.end(), warnings.begin(), warnings.end());
  out["warnings"] = json::warnings({}, all);
  return json::text_of(out);
}

}  // namespace tribin
