#include "tribin/sim/bop_writer.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/png.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/write.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::string numbered(const char* format, int a, int b = 0) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, a, b);
  return buffer;
}

void make_directory(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw Error(ErrorCode::bad_input, path.string() + ": cannot be made: " + error.message());
}

void write_json(const fs::path& path, const ordered_json& json) { io::write_file(path, json.dump(1) + "\n"); }

template <class Derived>
ordered_json row_wise(const Eigen::MatrixBase<Derived>& m) {
  ordered_json list = ordered_json::array();
  for (int i = 0; i < m.rows(); ++i)
    for (int k = 0; k < m.cols(); ++k) list.push_back(m(i, k));
  return list;
}

ordered_json intrinsics(const PinholeCamera& c) { return {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1}; }

ordered_json row_wise4(const Pose& pose) { return row_wise(pose.matrix()); }

/// The keys of models_info.json that tell which poses are the same, and which are nearly.
ordered_json symmetries(const Mesh& part) {
  const SymmetryResult found = find_symmetries(part);
  ordered_json out = ordered_json::object();
  for (std::size_t k = 1; k < found.group.discrete.size(); ++k)  // BOP leaves the identity out
    out["symmetries_discrete"].push_back(row_wise4(found.group.discrete[k]));
  for (const ContinuousSymmetry& s : found.group.continuous)
    out["symmetries_continuous"].push_back({{"axis", row_wise(s.axis)}, {"offset", row_wise(s.point)}});
  for (const SelfSimilarPose& pose : found.self_similar)
    out["near_symmetries_discrete"].push_back(row_wise4(pose.part_from_part));
  return out;
}

void write_mask(const fs::path& path, const Image<std::int16_t>& bodies, int body) {
  Image<std::uint8_t> mask(bodies.width, bodies.height);
  for (std::size_t i = 0; i < mask.size(); ++i) mask.data[i] = bodies.data[i] == body ? 255 : 0;
  io::write_file(path, io::encode_png8(mask));
}

Image<std::uint16_t> depth_steps(const Image<float>& z_mm, double scale) {
  Image<std::uint16_t> steps(z_mm.width, z_mm.height, 0);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!std::isfinite(z_mm.data[i])) continue;
    const double value = std::round(z_mm.data[i] / scale);
    if (!(value >= 1 && value <= 65535))
      throw Error(ErrorCode::out_of_range, "a depth of " + std::to_string(z_mm.data[i]) +
                                               " mm does not fit in 16 bit at " + std::to_string(scale) + " mm a step");
    steps.data[i] = static_cast<std::uint16_t>(value);
  }
  return steps;
}

/// The images of truth/. \param label  of each body, 0 = no part.
void write_truth(const fs::path& folder, const SimulatedScan& s, const std::vector<int>& label, double depth_scale) {
  make_directory(folder);
  const int w = s.body.width, h = s.body.height;
  Image<float> depth = s.true_z;
  Image<std::uint16_t> labels(w, h, 0), faces(w, h, 0), normals(3 * w, h, 0);
  for (std::size_t i = 0; i < s.body.size(); ++i) {
    const int k = s.body.data[i] >= 0 ? label[s.body.data[i]] : 0;
    if (k == 0) {
      depth.data[i] = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    labels.data[i] = static_cast<std::uint16_t>(k);
    if (s.face.data[i] <= 65535) faces.data[i] = static_cast<std::uint16_t>(s.face.data[i]);
    for (int c = 0; c < 3; ++c)
      normals.data[3 * i + c] = static_cast<std::uint16_t>(std::lround((s.normal.data[i][c] + 1) * 32767.5));
  }
  io::write_file(folder / "depth.png", io::encode_png16(depth_steps(depth, depth_scale)));
  io::write_file(folder / "label.png", io::encode_png16(labels));
  io::write_file(folder / "face.png", io::encode_png16(faces));
  io::write_file(folder / "normal.png", io::encode_png16_rgb(normals));
}

}  // namespace

double depth_scale_for(double largest_mm) {
  for (const double scale : {0.02, 0.05, 0.1})
    if (largest_mm < 65000 * scale) return scale;
  throw Error(ErrorCode::out_of_range, "depths up to " + std::to_string(largest_mm) + " mm; wanted < 6500 mm");
}

void write_bop_models(const fs::path& dataset, const std::vector<Mesh>& parts, const PinholeCamera& camera,
                      double depth_scale) {
  make_directory(dataset / "models");
  ordered_json info;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const int id = static_cast<int>(i) + 1;
    write_mesh(dataset / "models" / numbered("obj_%06d.ply", id), parts[i]);
    const Box box = bounding_box(parts[i].vertices);
    info[std::to_string(id)] = {{"name", parts[i].name},    {"diameter", diameter(parts[i].vertices)},
                                {"min_x", box.min.x()},     {"min_y", box.min.y()},
                                {"min_z", box.min.z()},     {"size_x", box.size().x()},
                                {"size_y", box.size().y()}, {"size_z", box.size().z()}};
    info[std::to_string(id)].update(symmetries(parts[i]));
  }
  write_json(dataset / "models" / "models_info.json", info);
  write_json(dataset / "camera.json", {{"cx", camera.cx},
                                       {"cy", camera.cy},
                                       {"fx", camera.fx},
                                       {"fy", camera.fy},
                                       {"width", camera.width},
                                       {"height", camera.height},
                                       {"depth_scale", depth_scale},
                                       {"cam_K", intrinsics(camera)}});
}

void write_bop_scene(const fs::path& folder, const BopImage& image, int classes, double depth_scale) {
  const SimulatedScan& s = *image.simulated;
  TRIBIN_ASSERT(image.object_of_body.size() == s.bodies.size());
  make_directory(folder / "depth");
  make_directory(folder / "mask_visib");
  io::write_file(folder / "depth" / "000000.png", io::encode_png16(depth_steps(s.scan.z_mm, depth_scale)));

  ordered_json gt = ordered_json::array(), info = ordered_json::array();
  std::vector<int> label(s.bodies.size(), 0);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    if (image.object_of_body[b] == 0) continue;
    const BodyTruth& t = s.bodies[b];
    write_mask(folder / "mask_visib" / numbered("000000_%06d.png", static_cast<int>(gt.size())), s.body,
               static_cast<int>(b));
    label[b] = static_cast<int>(gt.size()) + 1;
    gt.push_back({{"cam_R_m2c", row_wise(t.camera_from_body.linear())},
                  {"cam_t_m2c", row_wise(t.camera_from_body.translation())},
                  {"obj_id", image.object_of_body[b]}});
    info.push_back(
        {{"bbox_obj", t.box_all},
         {"bbox_visib", t.box_visible},
         {"px_count_all", t.pixels_all},
         {"px_count_valid", t.pixels_measured},
         {"px_count_visib", t.pixels_visible},
         {"px_count_measured", t.pixels_measured},
         {"visib_fract", t.visible_fraction()},
         {"measured_fract", t.pixels_all > 0 ? static_cast<double>(t.pixels_measured) / t.pixels_all : 0.0}});
    if (image.bounds.empty() || image.bounds[b].translation_mm <= 0) continue;
    info.back()["bound_mm"] = image.bounds[b].translation_mm;
    info.back()["bound_deg"] = image.bounds[b].rotation / kDegree;
  }
  write_json(folder / "scene_gt.json", {{"0", gt}});
  write_json(folder / "scene_gt_info.json", {{"0", info}});
  ordered_json camera = {{"cam_K", intrinsics(s.scan.camera)},
                         {"depth_scale", depth_scale},
                         {"cam_R_w2c", row_wise(image.camera_from_world.linear())},
                         {"cam_t_w2c", row_wise(image.camera_from_world.translation())}};
  if (image.scale_error > 0) camera["scale_error"] = image.scale_error;
  if (image.shape_error > 0) camera["shape_error"] = image.shape_error;
  write_json(folder / "scene_camera.json", {{"0", camera}});
  ordered_json all = ordered_json::array();
  for (int k = 1; k <= classes; ++k) all.push_back(k);
  write_json(folder / "scene_parts.json", {{"0", all}});
  write_truth(folder / "truth", s, label, depth_scale);
}

}  // namespace tribin::sim
