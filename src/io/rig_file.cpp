#include "tribin/io/rig_file.hpp"

#include <Eigen/LU>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/opencv_yaml.hpp"

namespace tribin {
namespace {

using io::bad_file;
using nlohmann::json;
using Matrices = std::map<std::string, io::YamlMatrix>;

void check_rotation(const std::string& file, const std::string& place, const Matrix3& r) {
  const double off = (r * r.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff();
  // Calibrations print six digits and more.
  if (!(off < 1e-4) || r.determinant() < 0)
    bad_file(file, place, "R R^T off the identity by " + std::to_string(off), "a rotation (right-handed, orthonormal)");
}

void check_intrinsics(const std::string& file, const std::string& place, const std::array<double, 9>& k,
                      PinholeCamera& camera) {
  if (std::abs(k[1]) > 1e-9 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1 || !(k[0] > 0) || !(k[4] > 0))
    bad_file(file, place, "another form", "[fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx, fy > 0, without skew");
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];
}

/// `count` numbers below a key.
std::vector<double> list(const std::string& file, const std::string& place, const json& object, const char* key,
                         std::size_t least, std::size_t most) {
  const std::string wanted =
      least == most ? std::to_string(most) + " numbers" : "up to " + std::to_string(most) + " numbers";
  if (!object.contains(key)) bad_file(file, place + key, "nothing", wanted);
  const json& value = object.at(key);
  if (!value.is_array() || value.size() < least || value.size() > most)
    bad_file(file, place + key, io::in_quotes(value.dump()), wanted);
  std::vector<double> out;
  for (const json& v : value) {
    if (!v.is_number()) bad_file(file, place + key, io::in_quotes(v.dump()), wanted);
    out.push_back(v.get<double>());
  }
  return out;
}

int pixels(const std::string& file, const std::string& place, const json& object, const char* key) {
  if (!object.contains(key) || !object.at(key).is_number_integer() || object.at(key).get<long long>() < 1 ||
      object.at(key).get<long long>() > 65535)
    bad_file(file, place + key, object.contains(key) ? io::in_quotes(object.at(key).dump()) : "nothing",
             "a whole number of pixels in 1..65535");
  return object.at(key).get<int>();
}

RigCamera camera_of(const std::string& file, const std::string& place, const json& object) {
  if (!object.is_object()) bad_file(file, place, io::in_quotes(object.dump()), "an object");
  RigCamera out;
  if (object.contains("name")) {
    if (!object.at("name").is_string())
      bad_file(file, place + "name", io::in_quotes(object.at("name").dump()), "a text");
    out.name = object.at("name").get<std::string>();
  }
  out.camera.width = pixels(file, place, object, "width");
  out.camera.height = pixels(file, place, object, "height");
  const std::vector<double> k = list(file, place, object, "K", 9, 9);
  std::array<double, 9> matrix{};
  std::copy(k.begin(), k.end(), matrix.begin());
  check_intrinsics(file, place + "K", matrix, out.camera);
  if (object.contains("distortion")) {
    const std::vector<double> d = list(file, place, object, "distortion", 0, 5);
    std::copy(d.begin(), d.end(), out.distortion.begin());
  }
  if (!object.contains("rig_from_camera")) return out;
  const json& pose = object.at("rig_from_camera");
  const std::string at = place + "rig_from_camera.";
  if (!pose.is_object() || !pose.contains("rotation") || !pose.at("rotation").is_array() ||
      pose.at("rotation").size() != 3)
    bad_file(file, at + "rotation", io::in_quotes(pose.dump()), "3 rows of 3 numbers");
  const json& rows = pose.at("rotation");
  for (int r = 0; r < 3; ++r) {
    const std::vector<double> row = list(file, at, json{{"rotation", rows[r]}}, "rotation", 3, 3);
    for (int c = 0; c < 3; ++c) out.rig_from_camera.linear()(r, c) = row[static_cast<std::size_t>(c)];
  }
  check_rotation(file, at + "rotation", out.rig_from_camera.linear());
  const std::vector<double> t = list(file, at, pose, "translation_mm", 3, 3);
  out.rig_from_camera.translation() = Vec3(t[0], t[1], t[2]);
  return out;
}

const io::YamlMatrix& need(const Matrices& all, const std::string& files, const char* key, int least, int most) {
  const auto found = all.find(key);
  if (found == all.end()) bad_file(files, "top level", std::string("no ") + key, "M1, D1, M2, D2, R, T of OpenCV");
  const int count = static_cast<int>(found->second.data.size());
  if (count < least || count > most)
    bad_file(found->second.file, found->second.place, std::to_string(count) + " numbers",
             std::to_string(least) + (least == most ? "" : " to " + std::to_string(most)));
  return found->second;
}

RigCamera opencv_camera(const Matrices& all, const std::string& files, const char* k_name, const char* d_name) {
  RigCamera out;
  const io::YamlMatrix& k = need(all, files, k_name, 9, 9);
  std::array<double, 9> matrix{};
  std::copy(k.data.begin(), k.data.end(), matrix.begin());
  check_intrinsics(k.file, k.place, matrix, out.camera);
  const io::YamlMatrix& d = need(all, files, d_name, 4, 14);
  for (std::size_t i = 0; i < d.data.size(); ++i) {
    if (i >= 5 && d.data[i] != 0)
      bad_file(d.file, d.place, "a model of more than 5 coefficients", "k1, k2, p1, p2, k3");
    if (i < 5) out.distortion[i] = d.data[i];
  }
  return out;
}

Rig opencv_rig(const Matrices& all, const std::string& files, double unit_mm) {
  Rig rig;
  rig.source = files;
  rig.cameras = {opencv_camera(all, files, "M1", "D1"), opencv_camera(all, files, "M2", "D2")};
  rig.cameras[0].name = "left";
  rig.cameras[1].name = "right";
  const io::YamlMatrix &r = need(all, files, "R", 9, 9), &t = need(all, files, "T", 3, 3);
  Pose second_from_first = Pose::Identity();
  second_from_first.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data.data());
  check_rotation(r.file, r.place, second_from_first.linear());
  second_from_first.translation() = unit_mm * Vec3(t.data[0], t.data[1], t.data[2]);
  rig.cameras[1].rig_from_camera = second_from_first.inverse();
  if (const auto size = all.find("S"); size != all.end() && size->second.data.size() == 2)
    for (RigCamera& c : rig.cameras) {
      c.camera.width = static_cast<int>(size->second.data[0]);
      c.camera.height = static_cast<int>(size->second.data[1]);
    }
  return rig;
}

Rig opencv_by_json(const io::FileBytes& file, const json& top, const std::filesystem::path& beside,
                   const std::filesystem::path& folder) {
  const json& names = top.at("opencv");
  if (!names.is_array() || names.empty())
    bad_file(file.name, "opencv", io::in_quotes(names.dump()), "a list of file names");
  Matrices all;
  std::string files;
  for (const json& name : names) {
    if (!name.is_string()) bad_file(file.name, "opencv", io::in_quotes(name.dump()), "a file name");
    std::filesystem::path place = beside / name.get<std::string>();
    if (!std::filesystem::exists(place) && !folder.empty()) place = folder / name.get<std::string>();
    const io::FileBytes yaml = io::read_file(place);
    all.merge(io::parse_opencv_yaml(yaml));
    files += (files.empty() ? "" : ", ") + yaml.name;
  }
  double unit = 1;
  if (top.contains("unit_mm")) {
    if (!top.at("unit_mm").is_number() || !(top.at("unit_mm").get<double>() > 0))
      bad_file(file.name, "unit_mm", io::in_quotes(top.at("unit_mm").dump()), "a length > 0");
    unit = top.at("unit_mm").get<double>();
  }
  Rig rig = opencv_rig(all, files, unit);
  if (top.contains("names")) {
    if (!top.at("names").is_array() || top.at("names").size() != rig.cameras.size())
      bad_file(file.name, "names", io::in_quotes(top.at("names").dump()), "one for each camera");
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      if (!top.at("names")[i].is_string()) bad_file(file.name, "names", io::in_quotes(top.at("names").dump()), "texts");
      rig.cameras[i].name = top.at("names")[i].get<std::string>();
    }
  }
  return rig;
}

nlohmann::ordered_json json_of(const RigCamera& c) {
  nlohmann::ordered_json out;
  out["name"] = c.name;
  out["width"] = c.camera.width;
  out["height"] = c.camera.height;
  out["K"] = {c.camera.fx, 0.0, c.camera.cx, 0.0, c.camera.fy, c.camera.cy, 0.0, 0.0, 1.0};
  out["distortion"] = c.distortion;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  const Matrix3 r = c.rig_from_camera.linear();
  for (int i = 0; i < 3; ++i) rows.push_back({r(i, 0), r(i, 1), r(i, 2)});
  const Vec3 t = c.rig_from_camera.translation();
  out["rig_from_camera"]["rotation"] = rows;
  out["rig_from_camera"]["translation_mm"] = {t.x(), t.y(), t.z()};
  return out;
}

}  // namespace

Rig read_rig(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const io::FileBytes file = io::read_file(path);
  if (file.view().substr(0, 5) == "%YAML") return opencv_rig(io::parse_opencv_yaml(file), file.name, 1);
  json top;
  try {
    top = json::parse(file.data);
  } catch (const json::parse_error& error) {
    bad_file(file.name, io::at_line(file.view(), error.byte), "text that is no JSON", "rig.json or OpenCV's YAML");
  }
  if (!top.is_object()) bad_file(file.name, "top level", io::in_quotes(top.dump()), "a JSON object");
  if (top.contains("opencv")) return opencv_by_json(file, top, path.parent_path(), folder);
  if (!top.contains("cameras") || !top.at("cameras").is_array() || top.at("cameras").empty())
    bad_file(file.name, "cameras", top.contains("cameras") ? io::in_quotes(top.at("cameras").dump()) : "nothing",
             "a list of one camera or more");
  Rig rig;
  rig.source = file.name;
  for (std::size_t i = 0; i < top.at("cameras").size(); ++i)
    rig.cameras.push_back(camera_of(file.name, "cameras[" + std::to_string(i) + "].", top.at("cameras")[i]));
  if (top.contains("projector") && !top.at("projector").is_null())
    rig.projector = camera_of(file.name, "projector.", top.at("projector"));
  return rig;
}

void write_rig(const std::filesystem::path& path, const Rig& rig) {
  nlohmann::ordered_json out;
  out["cameras"] = nlohmann::ordered_json::array();
  for (const RigCamera& c : rig.cameras) out["cameras"].push_back(json_of(c));
  out["projector"] = rig.projector ? json_of(*rig.projector) : nlohmann::ordered_json(nullptr);
  io::write_file(path, out.dump(2) + "\n");
}

}  // namespace tribin
