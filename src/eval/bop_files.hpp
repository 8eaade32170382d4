#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tribin/core/error.hpp"
#include "tribin/part/part.hpp"

namespace tribin::eval {

/// \throws Error bad_input
inline nlohmann::json read_bop_json(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file)
    throw Error(ErrorCode::bad_input, path.string() + ": cannot be opened; wanted a JSON file of a BOP data set");
  try {
    return nlohmann::json::parse(file);
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorCode::bad_input, path.string() + ": not JSON: " + e.what());
  }
}

inline std::string bop_number(int number) {
  char text[16];
  std::snprintf(text, sizeof text, "%06d", number);
  return text;
}

/// The mesh's file name without extension.
inline std::string bop_object_stem(int id) { return "obj_" + bop_number(id); }

/// \param info  the object's entry of models_info.json.
inline std::string bop_object_name(const nlohmann::json& info, int id) {
  return info.value("name", bop_object_stem(id));
}

/// A row-wise 4 x 4 matrix.
inline Pose pose_of_rows(const nlohmann::json& rows) {
  Pose out = Pose::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.linear()(i, j) = rows.at(4 * i + j).get<double>();
    out.translation()[i] = rows.at(4 * i + 3).get<double>();
  }
  return out;
}

inline Vec3 vector_of(const nlohmann::json& values) {
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

/// \param info  as of bop_object_name.
inline SymmetryGroup bop_symmetry(const nlohmann::json& info) {
  SymmetryGroup out;
  out.discrete.push_back(Pose::Identity());
  if (info.contains("symmetries_discrete"))
    for (const nlohmann::json& rows : info["symmetries_discrete"]) out.discrete.push_back(pose_of_rows(rows));
  if (info.contains("symmetries_continuous"))
    for (const nlohmann::json& s : info["symmetries_continuous"])
      out.continuous.push_back({vector_of(s.at("axis")), vector_of(s.at("offset"))});
  return out;
}

}  // namespace tribin::eval
