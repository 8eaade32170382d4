#include "tribin/report/bop_results.hpp"

#include <algorithm>
#include <fstream>
#include <map>

#include "report/json_values.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using json::Json;

constexpr const char* kHead = "scene_id,im_id,obj_id,score,R,t,time";

std::string place(const std::string& file, int line) { return file + ", line " + std::to_string(line) + ": "; }

Json parsed(const std::string& record, const std::string& file, int line) {
  Json out = Json::parse(record, nullptr, /*allow_exceptions=*/false);
  if (!out.is_object())
    throw Error(ErrorCode::bad_input, place(file, line) + "saw no JSON object; wanted a record of tribin bop");
  return out;
}

BopLine csv_line(const std::string& text, const std::string& file, int line) {
  BopLine out{0, 0, text + "\n"};
  if (std::sscanf(text.c_str(), "%d,%d,", &out.scene, &out.image) != 2)
    throw Error(ErrorCode::bad_input, place(file, line) + "wanted " + kHead);
  return out;
}

BopLine record_line(const std::string& text, const std::string& file, int line) {
  const Json record = parsed(text, file, line);
  try {
    return {record.at("scene_id"), record.at("im_id"), text + "\n"};
  } catch (const Json::exception& e) {
    throw Error(ErrorCode::bad_input, place(file, line) + e.what());
  }
}

std::string blank_separated(const Json& values) {
  std::string out;
  for (const Json& value : values) {
    if (value.is_array())
      out += (out.empty() ? "" : " ") + blank_separated(value);
    else
      out += (out.empty() ? "" : " ") + value.dump();
  }
  return out;
}

}  // namespace

std::string bop_record(const eval::BopTask& task, std::span<const eval::BopObject> objects, const Scan& scan,
                       const Found& found, const JsonOptions& options) {
  Json out = {{"scene_id", task.scene}, {"im_id", task.image}, {"offered", Json::array()}};
  for (const eval::BopObject& object : objects)
    if (std::binary_search(task.objects.begin(), task.objects.end(), object.id))
      out["offered"].push_back({{"obj_id", object.id}, {"part", object.name}});
  out.update(Json::parse(locate_json(scan, found, options)));
  return out.dump() + "\n";
}

std::vector<BopLine> bop_csv_rows(const std::string& record, const std::string& file, int line) {
  const Json result = parsed(record, file, line);
  std::vector<BopLine> out;
  try {
    std::map<std::string, int> id_of;
    for (const Json& object : result.at("offered")) id_of[object.at("part")] = object.at("obj_id");
    const Json time = result.contains("stages_ms")
                          ? json::rounded(result["stages_ms"].at("total").get<double>() / 1000, 5)
                          : Json(-1);
    for (const Json& instance : result.at("instances")) {
      const Json& pose = instance.at("camera_from_part");
      BopLine row{result.at("scene_id"), result.at("im_id"), {}};
      row.text = std::to_string(row.scene) + "," + std::to_string(row.image) + "," +
                 std::to_string(id_of.at(instance.at("part"))) + "," + instance.at("score").dump() + "," +
                 blank_separated(pose.at("rotation")) + "," + blank_separated(pose.at("translation_mm")) + "," +
                 time.dump() + "\n";
      out.push_back(std::move(row));
    }
  } catch (const Json::exception& e) {
    throw Error(ErrorCode::bad_input, place(file, line) + e.what());
  } catch (const std::out_of_range&) {
    throw Error(ErrorCode::bad_input, place(file, line) + "an instance of a part that was not offered");
  }
  return out;
}

std::vector<BopLine> read_bop_lines(const std::filesystem::path& path) {
  const bool csv = path.extension() == ".csv";
  if (!csv && path.extension() != ".ndjson")
    throw Error(ErrorCode::bad_input, path.string() + ": wanted results as .csv or .ndjson");
  std::ifstream file(path);
  if (!file) throw Error(ErrorCode::bad_input, path.string() + ": cannot be opened; wanted results of tribin bop");
  std::vector<BopLine> out;
  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (text.empty() || (csv && text.starts_with("scene_id"))) continue;
    out.push_back(csv ? csv_line(text, path.string(), line) : record_line(text, path.string(), line));
  }
  return out;
}

std::string merged_bop_lines(const std::vector<std::vector<BopLine>>& files, bool csv) {
  std::map<std::pair<int, int>, std::string> images;
  for (const std::vector<BopLine>& file : files) {
    std::map<std::pair<int, int>, std::string> own;
    for (const BopLine& line : file) own[{line.scene, line.image}] += line.text;
    for (const auto& [key, text] : own) {
      const auto [at, fresh] = images.emplace(key, text);
      if (!fresh && at->second != text)
        throw Error(ErrorCode::bad_input, "scene " + std::to_string(key.first) + ", image " +
                                              std::to_string(key.second) + " stands in two files with other results");
    }
  }
  std::string out = csv ? std::string(kHead) + "\n" : "";
  for (const auto& [key, text] : images) out += text;
  return out;
}

}  // namespace tribin
