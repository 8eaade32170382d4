#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tribin/core/error.hpp"

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

}  // namespace tribin::eval
