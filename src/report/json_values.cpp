#include "report/json_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

namespace tribin::json {

Json rounded(double value, int decimals) {
  if (!std::isfinite(value)) return nullptr;
  const double step = std::pow(10.0, decimals);
  return std::round(value * step) / step + 0.0;  // + 0.0 turns -0 into 0
}

Json significant(double value) {
  if (!std::isfinite(value)) return nullptr;
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.6g", value);
  return std::strtod(digits, nullptr) + 0.0;
}

Json millimetres(double value) { return rounded(value, 5); }
Json millimetres(const Vec3& v) { return {millimetres(v.x()), millimetres(v.y()), millimetres(v.z())}; }
Json unit_vector(const Vec3& v) { return {rounded(v.x(), 9), rounded(v.y(), 9), rounded(v.z(), 9)}; }
Json degrees(double radians) { return rounded(radians / kDegree, 4); }

Json rotation(const Matrix3& r) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(unit_vector(Vec3(r.row(i).transpose())));
  return rows;
}

Json pose(const Pose& pose) {
  return {{"rotation", rotation(Matrix3(pose.linear()))}, {"translation_mm", millimetres(Vec3(pose.translation()))}};
}

Json matrix6(const Matrix6& matrix) {
  Json rows = Json::array();
  for (int i = 0; i < 6; ++i) {
    Json row = Json::array();
    for (int j = 0; j < 6; ++j) row.push_back(significant(matrix(i, j)));
    rows.push_back(row);
  }
  return rows;
}

Matrix6 turned(const Matrix6& covariance, const Matrix3& r) {
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = r;
  turn.bottomRightCorner<3, 3>() = r;
  return turn * covariance * turn.transpose();
}

Vector6 turned(const Vector6& direction, const Matrix3& r) {
  Vector6 out;
  out.head<3>() = r * direction.head<3>();
  out.tail<3>() = r * direction.tail<3>();
  return out;
}

Primitive moved(const Primitive& primitive, const Pose& b_from_a) {
  Primitive out = primitive;
  out.axis = b_from_a.linear() * primitive.axis;
  out.point = b_from_a * primitive.point;
  out.offset_mm = primitive.offset_mm + out.axis.dot(b_from_a.translation());
  return out;
}

Json head() { return {{"tribin", TRIBIN_VERSION}, {"schema", 1}}; }

Json scan_summary(const Scan& scan, const Surfels* surfels) {
  double noise_mm = scan.noise.sigma_mm;
  if (noise_mm <= 0 && surfels) {
    std::vector<float> known;
    for (float sigma : surfels->local_sigma_mm.data)
      if (sigma > 0) known.push_back(sigma);
    if (!known.empty()) {
      std::nth_element(known.begin(), known.begin() + known.size() / 2, known.end());
      noise_mm = known[known.size() / 2];
    }
  }
  return {{"file", std::filesystem::path(scan.source).filename().string()},
          {"width", scan.width()},
          {"height", scan.height()},
          {"valid_points", valid_count(scan)},
          {"noise_mm", rounded(noise_mm, 4)}};
}

Json cloud_summary(const Surfels& surfels) {
  std::vector<float> sigma(surfels.sigma_mm);
  std::nth_element(sigma.begin(), sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2), sigma.end());
  const std::size_t points = surfels.point_set->points.size();
  return {{"file", std::filesystem::path(surfels.point_set->source).filename().string()},
          {"width", points},
          {"height", 1},
          {"valid_points", points},
          {"noise_mm", rounded(sigma[sigma.size() / 2], 4)}};
}

Json stages(const StageTimes& times) {
  Json out = Json::object();
  for (const auto& [stage, ms] : times.stages_ms) out[stage] = rounded(ms, 2);
  out["total"] = rounded(times.total(), 2);
  return out;
}

Json warnings(const std::vector<Warning>& warnings, const std::vector<std::string>& more) {
  Json out = Json::array();
  for (const Warning& warning : warnings) out.push_back({{"code", warning.code}, {"text", warning.text}});
  for (const std::string& text : more) {
    const bool known =
        std::any_of(warnings.begin(), warnings.end(), [&](const Warning& warning) { return warning.text == text; });
    if (!known) out.push_back({{"code", "input"}, {"text", text}});
  }
  return out;
}

Json primitive(const Primitive& p, const HoughSpaces* spaces) {
  Json out = {{"id", p.id}, {"type", name_of(p.type)}};
  if (!p.name.empty()) out["name"] = p.name;
  out["points"] = p.points;
  out["area_mm2"] = rounded(p.area_mm2, 2);
  out["rms_mm"] = rounded(p.rms_mm, 5);
  switch (p.type) {
    case PrimitiveType::plane:
      out["normal"] = unit_vector(p.axis);
      out["offset_mm"] = millimetres(p.offset_mm);
      out["center_mm"] = millimetres(p.point);
      break;
    case PrimitiveType::cylinder:
      out["axis"] = unit_vector(p.axis);
      out["point_mm"] = millimetres(p.point);
      out["radius_mm"] = millimetres(p.radius_mm);
      out["radius_from_cad"] = p.radius_from_cad;
      out["height_mm"] = millimetres(p.height_mm());
      out["arc_deg"] = degrees(p.arc);
      out["concave"] = p.concave;
      out["fillet"] = p.fillet;
      break;
    case PrimitiveType::cone:
      out["axis"] = unit_vector(p.axis);
      out["apex_mm"] = millimetres(p.point);
      out["half_angle_deg"] = degrees(p.half_angle);
      out["height_mm"] = millimetres(p.height_mm());
      out["arc_deg"] = degrees(p.arc);
      out["concave"] = p.concave;
      break;
    case PrimitiveType::torus:
      out["axis"] = unit_vector(p.axis);
      out["center_mm"] = millimetres(p.point);
      out["radius_mm"] = millimetres(p.radius_mm);
      out["minor_radius_mm"] = millimetres(p.minor_radius_mm);
      out["concave"] = p.concave;
      out["fillet"] = p.fillet;
      break;
    case PrimitiveType::sphere:
      out["center_mm"] = millimetres(p.point);
      out["radius_mm"] = millimetres(p.radius_mm);
      out["concave"] = p.concave;
      break;
  }
  Json loops = Json::array();
  for (const BoundaryLoop& loop : p.loops) {
    if (!loop.circle) continue;
    loops.push_back({{"inner", loop.inner},
                     {"center_mm", millimetres(loop.circle->center)},
                     {"radius_mm", millimetres(loop.circle->radius_mm)},
                     {"rms_mm", rounded(loop.circle->rms_mm, 5)},
                     {"arc_deg", degrees(loop.circle->arc)}});
  }
  if (!loops.empty()) out["boundary_circles"] = loops;
  if (spaces && p.peak >= 0 && p.peak < static_cast<int>(spaces->peaks.size())) {
    const HoughPeak& peak = spaces->peaks[p.peak];
    out["peak"] = {{"space", peak.parameter_space ? "parameter" : "ijk"}, {"direction", unit_vector(peak.direction)}};
    if (peak.parameter_space) out["peak"]["d"] = rounded(peak.d, 6);
  }
  out["covariance"] = matrix6(p.covariance);
  return out;
}

Json relation(const Relation& r, const Pose& b_from_a) {
  static const char* const kNames[] = {"plane_plane", "plane_cylinder", "cylinder_cylinder"};
  Json out = {{"first", r.first},
              {"second", r.second},
              {"type", kNames[static_cast<int>(r.type)]},
              {"angle_deg", degrees(r.angle)},
              {"distance_mm", millimetres(r.distance_mm)},
              {"adjacent", r.adjacent},
              {"coaxial", r.coaxial}};
  const Vec3 point = b_from_a * r.line_point;
  if (!r.line_direction.isZero())
    out["line"] = {{"point_mm", millimetres(point)}, {"direction", unit_vector(b_from_a.linear() * r.line_direction)}};
  else if (!r.line_point.isZero())
    out["point_mm"] = millimetres(point);
  return out;
}

Json counts(const std::vector<Primitive>& primitives) {
  int count[5] = {0, 0, 0, 0, 0};
  for (const Primitive& primitive : primitives) ++count[static_cast<int>(primitive.type)];
  Json out = {{"planes", count[0]}, {"cylinders", count[1]}, {"cones", count[2]}, {"spheres", count[3]}};
  if (count[4] > 0) out["tori"] = count[4];
  return out;
}

namespace {

bool is_flat(const Json& value) {
  return std::all_of(value.begin(), value.end(), [](const Json& item) { return item.is_primitive(); });
}

void write(const Json& value, int level, std::string& out) {
  const std::string inner(2 * (level + 1), ' '), outer(2 * level, ' ');
  if (value.is_primitive() || value.empty()) {
    out += value.dump();
    return;
  }
  const bool one_line = value.is_array() && is_flat(value);
  const char* const brackets = value.is_array() ? "[]" : "{}";
  out += brackets[0];
  bool first = true;
  for (const auto& item : value.items()) {
    if (!first) out += one_line ? ", " : ",";
    if (!one_line) out += "\n" + inner;
    first = false;
    if (value.is_object()) out += Json(item.key()).dump() + ": ";
    write(item.value(), level + 1, out);
  }
  if (!one_line) out += "\n" + outer;
  out += brackets[1];
}

}  // namespace

std::string text_of(const Json& document) {
  std::string out;
  write(document, 0, out);
  return out + "\n";
}

std::string with(const char* format, double a, double b, double c) {
  char text[300];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

}  // namespace tribin::json
