#include "tribin/eval/results.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>

#include "eval/bop_files.hpp"

namespace tribin::eval {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ByImage = std::map<std::pair<int, int>, ImageResult>;

[[noreturn]] void fail(const fs::path& file, int line, const std::string& what) {
  throw Error(ErrorCode::bad_input, file.string() + ", line " + std::to_string(line) + ": " + what);
}

ImageResult& image_of(ByImage& images, int scene, int image) {
  ImageResult& out = images[{scene, image}];
  out.scene = scene;
  out.image = image;
  return out;
}

template <int N>
void read_numbers(const std::string& text, double (&numbers)[N], const fs::path& file, int line) {
  std::istringstream words(text);
  std::string rest;
  for (double& number : numbers)
    if (!(words >> number)) fail(file, line, "saw \"" + text + "\"; wanted " + std::to_string(N) + " numbers");
  if (words >> rest) fail(file, line, "saw \"" + text + "\"; wanted " + std::to_string(N) + " numbers");
}

void read_csv_row(const std::string& text, std::span<const Model> models, const fs::path& file, int line,
                  ByImage& images) {
  std::istringstream row(text);
  std::vector<std::string> fields;
  for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
  if (fields.size() != 7) fail(file, line, "wanted scene_id,im_id,obj_id,score,R,t,time");
  double head[4], r[9], t[3], time[1];
  read_numbers(fields[0] + " " + fields[1] + " " + fields[2] + " " + fields[3], head, file, line);
  read_numbers(fields[4], r, file, line);
  read_numbers(fields[5], t, file, line);
  read_numbers(fields[6], time, file, line);
  const auto model = std::find_if(models.begin(), models.end(), [&](const Model& m) { return m.id == head[2]; });
  if (model == models.end()) fail(file, line, "object " + fields[2] + " has no model");
  Instance instance;
  instance.part = model->name;
  instance.score = head[3];
  for (int i = 0; i < 9; ++i) instance.camera_from_part.linear()(i / 3, i % 3) = r[i];
  for (int i = 0; i < 3; ++i) instance.camera_from_part.translation()[i] = t[i];
  ImageResult& image = image_of(images, static_cast<int>(head[0]), static_cast<int>(head[1]));
  image.instances.push_back(instance);
  image.seconds = time[0];
}

Pose pose_from(const Json& json) {
  Pose out = Pose::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out.linear()(i, k) = json.at("rotation").at(i).at(k).get<double>();
    out.translation()[i] = json.at("translation_mm").at(i).get<double>();
  }
  return out;
}

Instance instance_from(const Json& json) {
  Instance out;
  out.id = json.at("id");
  out.part = json.at("part");
  out.score = json.at("score");
  out.visible_fraction = json.at("visible_fraction");
  out.camera_from_part = pose_from(json.at("camera_from_part"));
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) out.covariance(i, k) = json.at("covariance").at(i).at(k).get<double>();
  for (const Json& direction : json.at("free_directions")) {
    Vector6 d;
    for (int i = 0; i < 6; ++i) d[i] = direction.at(i).get<double>();
    out.free_directions.push_back(d);
  }
  for (const Json& other : json.at("alternatives"))
    out.alternatives.push_back({pose_from(other), other.at("probability"), other.at("decided_by")});
  return out;
}

Reason reason_from(const Json& json) {
  Reason out;
  out.part = json.at("part");
  out.stage = json.at("stage");
  out.test = json.at("test");
  const auto number = [&](const char* key) { return json.at(key).is_number() ? json.at(key).get<double>() : 0; };
  out.value = number("value");
  out.limit = number("limit");
  out.count = json.at("count");
  if (json.contains("nearest")) {
    const Json& at = json.at("nearest").at("at_mm");
    out.at_mm = Vec3(at.at(0), at.at(1), at.at(2));
  }
  return out;
}

void read_record(const std::string& text, const fs::path& file, int line, ByImage& images) {
  try {
    const Json record = Json::parse(text);
    ImageResult& image = image_of(images, record.at("scene_id"), record.at("im_id"));
    for (const Json& instance : record.at("instances")) image.instances.push_back(instance_from(instance));
    if (record.contains("uncertain"))
      for (const Json& instance : record.at("uncertain")) image.uncertain.push_back(instance_from(instance));
    for (const Json& reason : record.at("rejected")) image.rejected.push_back(reason_from(reason));
    image.offered.emplace();
    for (const Json& object : record.at("offered")) image.offered->push_back(object.at("part"));
    if (record.contains("stages_ms")) image.seconds = record["stages_ms"].at("total").get<double>() / 1000;
  } catch (const Json::exception& e) {
    fail(file, line, std::string("wanted a record of tribin bop: ") + e.what());
  }
}

}  // namespace

std::vector<ImageResult> read_results(const fs::path& path, std::span<const Model> models) {
  const bool csv = path.extension() == ".csv";
  if (!csv && path.extension() != ".ndjson")
    throw Error(ErrorCode::bad_input, path.string() + ": wanted results as .csv or .ndjson");
  std::ifstream file(path);
  if (!file) throw Error(ErrorCode::bad_input, path.string() + ": cannot be opened; wanted results of tribin bop");
  ByImage images;
  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (text.empty() || (csv && text.starts_with("scene_id"))) continue;
    if (csv)
      read_csv_row(text, models, path, line, images);
    else
      read_record(text, path, line, images);
  }
  std::vector<ImageResult> out;
  for (auto& [key, image] : images) {
    std::stable_sort(image.instances.begin(), image.instances.end(),
                     [](const Instance& a, const Instance& b) { return a.score > b.score; });
    out.push_back(std::move(image));
  }
  return out;
}

}  // namespace tribin::eval
