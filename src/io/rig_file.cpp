#include "tribin/io/rig_file.hpp"

#include <Eigen/LU>
#include <cmath>

#include "io/atomic_file.hpp"
#include "io/json_fields.hpp"
#include "io/opencv_yaml.hpp"

namespace tribin {
namespace {

using io::bad_file;
using io::JsonPlace;
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

RigCamera camera_of(const std::string& file, const JsonPlace& object) {
  object.must_be_object("an object with width, height, K");
  RigCamera out;
  if (object.has("name")) out.name = object.at("name", "").text("a text");
  constexpr const char* kPixels = "a whole number of pixels in 1..65535";
  out.camera.width = object.at("width", kPixels).whole(1, 65535, kPixels);
  out.camera.height = object.at("height", kPixels).whole(1, 65535, kPixels);
  const JsonPlace k = object.at("K", "9 numbers, row-wise");
  const std::vector<double> list = k.numbers(9, "9 numbers, row-wise");
  std::array<double, 9> matrix{};
  std::copy(list.begin(), list.end(), matrix.begin());
  check_intrinsics(file, k.place(), matrix, out.camera);
  if (object.has("distortion")) {
    const std::vector<double> d = object.at("distortion", "").numbers(0, 5, "up to 5 numbers: k1, k2, p1, p2, k3");
    std::copy(d.begin(), d.end(), out.distortion.begin());
  }
  if (!object.has("rig_from_camera")) return out;
  const JsonPlace pose = object.at("rig_from_camera", ""), rows = pose.at("rotation", "3 rows of 3 numbers");
  if (rows.array_size("3 rows of 3 numbers") != 3) rows.fail("3 rows of 3 numbers");
  for (std::size_t r = 0; r < 3; ++r) {
    const std::vector<double> row = rows.at(r).numbers(3, "3 numbers");
    for (std::size_t c = 0; c < 3; ++c)
      out.rig_from_camera.linear()(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = row[c];
  }
  check_rotation(file, rows.place(), out.rig_from_camera.linear());
  const std::vector<double> t = pose.at("translation_mm", "3 numbers").numbers(3, "3 numbers");
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

Rig opencv_by_json(const JsonPlace& top, const std::filesystem::path& beside, const std::filesystem::path& folder) {
  const JsonPlace names = top.at("opencv", "");
  constexpr const char* kFiles = "a list of file names";
  if (names.array_size(kFiles) == 0) names.fail(kFiles);
  Matrices all;
  std::string files;
  for (std::size_t i = 0; i < names.value().size(); ++i) {
    const std::string name = names.at(i).text("a file name");
    std::filesystem::path place = beside / name;
    if (!std::filesystem::exists(place) && !folder.empty()) place = folder / name;
    const io::FileBytes yaml = io::read_file(place);
    all.merge(io::parse_opencv_yaml(yaml));
    files += (files.empty() ? "" : ", ") + yaml.name;
  }
  double unit = 1;
  // A unit between a micrometre and a kilometre.
  if (top.has("unit_mm")) unit = top.at("unit_mm", "").number(1e-3, 1e6, "a length > 0");
  Rig rig = opencv_rig(all, files, unit);
  if (!top.has("names")) return rig;
  const JsonPlace cameras = top.at("names", "");
  if (cameras.array_size("one for each camera") != rig.cameras.size()) cameras.fail("one for each camera");
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) rig.cameras[i].name = cameras.at(i).text("a name");
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
  const nlohmann::json document = io::parse_json(file, "rig.json or OpenCV's YAML");
  const JsonPlace top(file.name, document, JsonPlace::kTop);
  top.must_be_object("a JSON object");
  if (top.has("opencv")) return opencv_by_json(top, path.parent_path(), folder);
  constexpr const char* kCameras = "a list of one camera or more";
  const JsonPlace cameras = top.at("cameras", kCameras);
  if (cameras.array_size(kCameras) == 0) cameras.fail(kCameras);
  Rig rig;
  rig.source = file.name;
  for (std::size_t i = 0; i < cameras.value().size(); ++i) rig.cameras.push_back(camera_of(file.name, cameras.at(i)));
  if (top.has("projector") && !top.at("projector", "").value().is_null())
    rig.projector = camera_of(file.name, top.at("projector", ""));
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
