#include <algorithm>

#include "eval/bop_files.hpp"
#include "tribin/eval/eval.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin::eval {
namespace {

using Json = nlohmann::json;

constexpr int kSurfacePoints = 20000;  // 1 % of the diameter apart on a ball

Pose pose_of(const Json& rotation, const Json& translation) {
  Pose out = Pose::Identity();
  for (int i = 0; i < 9; ++i) out.linear()(i / 3, i % 3) = rotation.at(i).get<double>();
  for (int i = 0; i < 3; ++i) out.translation()[i] = translation.at(i).get<double>();
  return out;
}

}  // namespace

std::vector<Model> read_bop_models(const std::filesystem::path& models_dir) {
  const std::filesystem::path info_path = models_dir / "models_info.json";
  const Json infos = read_bop_json(info_path);
  std::vector<std::pair<int, Model>> models;
  try {
    for (const auto& [key, info] : infos.items()) {
      const int id = std::stoi(key);
      Model model;
      model.name = bop_object_name(info, id);
      const Mesh mesh = read_cad(models_dir / (bop_object_stem(id) + ".ply"));
      model.id = id;
      model.vertices = mesh.vertices;
      model.surface = points_on(mesh, kSurfacePoints);
      model.diameter_mm = info.at("diameter");
      const Vec3 low(info.at("min_x"), info.at("min_y"), info.at("min_z"));
      model.box_center = low + 0.5 * Vec3(info.at("size_x"), info.at("size_y"), info.at("size_z"));
      model.symmetry = bop_symmetry(info);
      if (info.contains("near_symmetries_discrete"))
        for (const Json& rows : info["near_symmetries_discrete"]) model.near_symmetries.push_back(pose_of_rows(rows));
      models.emplace_back(id, std::move(model));
    }
  } catch (const std::logic_error& e) {
    throw Error(ErrorCode::bad_input, info_path.string() + ": wanted object ids as keys: " + e.what());
  } catch (const Json::exception& e) {
    throw Error(ErrorCode::bad_input, info_path.string() + ": " + e.what());
  }
  std::sort(models.begin(), models.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Model> out;
  for (auto& [id, model] : models) out.push_back(std::move(model));
  return out;
}

std::vector<Truth> read_bop_truth(const std::filesystem::path& scene_gt, int image,
                                  const std::filesystem::path& models_dir) {
  const Json truths = read_bop_json(scene_gt);
  const Json infos = read_bop_json(models_dir / "models_info.json");
  const std::filesystem::path visible_path = scene_gt.parent_path() / "scene_gt_info.json";
  const Json visible = std::filesystem::exists(visible_path) ? read_bop_json(visible_path) : Json::object();
  const std::string key = std::to_string(image);
  std::vector<Truth> out;
  try {
    if (!truths.contains(key)) throw Error(ErrorCode::bad_input, scene_gt.string() + ": has no image " + key);
    for (std::size_t i = 0; i < truths[key].size(); ++i) {
      const Json& entry = truths[key][i];
      const int id = entry.at("obj_id");
      Truth truth;
      truth.part = bop_object_name(infos.at(std::to_string(id)), id);
      truth.camera_from_part = pose_of(entry.at("cam_R_m2c"), entry.at("cam_t_m2c"));
      if (visible.contains(key)) {
        const Json& seen = visible[key].at(i);
        truth.visible_fraction = seen.at("visib_fract");
        truth.bound_mm = seen.value("bound_mm", 0.0);
        truth.bound_rotation = seen.value("bound_deg", 0.0) * kDegree;
      }
      out.push_back(truth);
    }
  } catch (const Json::exception& e) {
    throw Error(ErrorCode::bad_input, scene_gt.string() + ", image " + key + ": " + e.what());
  }
  return out;
}

}  // namespace tribin::eval
