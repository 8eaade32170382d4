#include "tribin/eval/bop_dataset.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "eval/bop_files.hpp"
#include "tribin/core/content_hash.hpp"

namespace tribin::eval {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// The number that a name is; -1 for any other name.
int number_of(const std::string& name) {
  int value = -1;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), value);
  return error == std::errc() && end == name.data() + name.size() && value >= 0 ? value : -1;
}

/// The depth image as data sets have it: PNG mostly, TIFF in ITODD.
fs::path depth_file(const fs::path& scene, int image) {
  for (const char* extension : {".png", ".tif", ".tiff"}) {
    const fs::path path = scene / "depth" / (bop_number(image) + extension);
    if (fs::exists(path)) return path;
  }
  throw Error(ErrorCode::bad_input,
              (scene / "depth" / bop_number(image)).string() + ": saw no .png, .tif or .tiff, wanted a depth image");
}

using ImageKey = std::pair<int, int>;  // scene, image

std::map<ImageKey, std::set<int>> named_by_targets(const fs::path& file) {
  const Json targets = read_bop_json(file);
  std::map<ImageKey, std::set<int>> out;
  if (!targets.is_array())
    throw Error(ErrorCode::bad_input, file.string() + ": saw no list; wanted one of im_id, obj_id, scene_id");
  for (std::size_t i = 0; i < targets.size(); ++i) try {
      const Json& target = targets[i];
      out[{target.at("scene_id"), target.at("im_id")}].insert(target.at("obj_id").get<int>());
    } catch (const Json::exception& e) {
      throw Error(ErrorCode::bad_input, file.string() + ": entry " + std::to_string(i) + ": " + e.what());
    }
  return out;
}

/// Every image that scene_camera.json knows, with the parts of scene_parts.json where there is one.
std::map<ImageKey, std::set<int>> all_images(const fs::path& split, const std::set<int>& all_objects) {
  std::map<ImageKey, std::set<int>> out;
  for (const fs::directory_entry& entry : fs::directory_iterator(split)) {
    const int scene = number_of(entry.path().filename().string());
    if (scene < 0 || !entry.is_directory()) continue;
    const Json cameras = read_bop_json(entry.path() / "scene_camera.json");
    const fs::path parts_file = entry.path() / "scene_parts.json";
    const Json parts = fs::exists(parts_file) ? read_bop_json(parts_file) : Json::object();
    for (const auto& [key, ignored] : cameras.items()) {
      const int image = number_of(key);
      if (image < 0)
        throw Error(ErrorCode::bad_input, (entry.path() / "scene_camera.json").string() + ": saw the key '" + key +
                                              "'; wanted the number of an image");
      try {
        out[{scene, image}] = parts.contains(key) ? parts.at(key).get<std::set<int>>() : all_objects;
      } catch (const Json::exception& e) {
        throw Error(ErrorCode::bad_input, parts_file.string() + ", image " + key + ": " + e.what());
      }
    }
  }
  return out;
}

}  // namespace

std::vector<BopObject> list_bop_objects(const fs::path& models_dir) {
  const fs::path info_path = models_dir / "models_info.json";
  const Json infos = fs::exists(info_path) ? read_bop_json(info_path) : Json::object();
  std::vector<BopObject> out;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(models_dir, error)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() != ".ply" || !stem.starts_with("obj_")) continue;
    const int id = number_of(stem.substr(4));
    if (id < 0) continue;
    const std::string key = std::to_string(id);
    const Json info = infos.contains(key) ? infos.at(key) : Json::object();
    try {
      out.push_back({id, bop_object_name(info, id), entry.path(), bop_symmetry(info)});
    } catch (const Json::exception& e) {
      throw Error(ErrorCode::bad_input, info_path.string() + ", object " + key + ": " + e.what());
    }
  }
  if (out.empty())
    throw Error(ErrorCode::bad_input, models_dir.string() + ": saw no obj_*.ply; wanted the models of a BOP data set");
  std::sort(out.begin(), out.end(), [](const BopObject& a, const BopObject& b) { return a.id < b.id; });
  std::set<std::string> names;
  for (const BopObject& object : out)
    if (!names.insert(object.name).second)
      throw Error(ErrorCode::bad_input, info_path.string() + ": two objects are named '" + object.name + "'");
  return out;
}

std::vector<BopTask> list_bop_tasks(const fs::path& dataset, const std::string& split, const fs::path& targets,
                                    const std::vector<BopObject>& objects) {
  const fs::path folder = dataset / split;
  if (!fs::is_directory(folder))
    throw Error(ErrorCode::bad_input, folder.string() + ": saw no such folder; wanted a split of a BOP data set");
  std::set<int> ids;
  for (const BopObject& object : objects) ids.insert(object.id);
  const std::map<ImageKey, std::set<int>> images =
      targets.empty() ? all_images(folder, ids) : named_by_targets(targets);
  std::vector<BopTask> out;
  for (const auto& [key, wanted] : images) {
    for (const int id : wanted)
      if (!ids.count(id))
        throw Error(ErrorCode::bad_input, (targets.empty() ? folder : targets).string() + ": scene " +
                                              std::to_string(key.first) + " names object " + std::to_string(id) +
                                              ", which has no model");
    const fs::path scene = folder / bop_number(key.first);
    out.push_back({key.first,
                   key.second,
                   {wanted.begin(), wanted.end()},
                   depth_file(scene, key.second),
                   scene / "scene_camera.json"});
  }
  if (out.empty()) throw Error(ErrorCode::bad_input, folder.string() + ": saw no image; wanted one at least");
  return out;
}

int shard_of(int scene, int image, int shards) {
  const ContentHash hash = content_hash(std::to_string(scene) + "/" + std::to_string(image));
  return static_cast<int>(hash[0] % static_cast<std::uint64_t>(shards));
}

}  // namespace tribin::eval
