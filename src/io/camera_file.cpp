#include "tribin/io/camera_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/file_bytes.hpp"
#include "tribin/core/distortion.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using nlohmann::json;

/// A finite number below a key; `place` leads to the object inside the file.
double number(const std::string& file, const std::string& place, const json& object, const char* key) {
  const json& value = object.at(key);
  if (!value.is_number() || !std::isfinite(value.get<double>())) {
    io::bad_file(file, place + key, io::in_quotes(value.dump()), "a number");
  }
  return value.get<double>();
}

void read_matrix(const std::string& file, const std::string& place, const json& object, PinholeCamera& camera) {
  const json& k = object.at("cam_K");
  if (!k.is_array() || k.size() != 9)
    io::bad_file(file, place + "cam_K", io::in_quotes(k.dump()), "9 numbers, row-wise");
  std::array<double, 9> m{};
  for (std::size_t i = 0; i < 9; ++i) {
    if (!k[i].is_number()) io::bad_file(file, place + "cam_K", io::in_quotes(k[i].dump()), "9 numbers, row-wise");
    m[i] = k[i].get<double>();
  }
  // Skew would be lost by PinholeCamera, so it is refused, not dropped.
  if (std::abs(m[1]) > 1e-9 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1) {
    io::bad_file(file, place + "cam_K", io::in_quotes(k.dump()), "[fx, 0, cx, 0, fy, cy, 0, 0, 1] without skew");
  }
  camera.fx = m[0];
  camera.cx = m[2];
  camera.fy = m[4];
  camera.cy = m[5];
}

CameraFile from_object(const std::string& file, const std::string& place, const json& object) {
  CameraFile result;
  PinholeCamera& camera = result.camera;
  // Photoneo's .intr (as autolab_core writes it) has the same numbers below keys with an underscore.
  const std::string prefix = object.contains("_fx") ? "_" : "";
  if (object.contains("cam_K")) {
    read_matrix(file, place, object, camera);
  } else {
    for (const auto& [key, field] :
         {std::pair{"fx", &camera.fx}, {"fy", &camera.fy}, {"cx", &camera.cx}, {"cy", &camera.cy}}) {
      if (!object.contains(prefix + key)) {
        io::bad_file(file, place.empty() ? "top level" : place, "neither cam_K nor fx, fy, cx, cy", "the intrinsics");
      }
      *field = number(file, place, object, (prefix + key).c_str());
    }
  }
  if (!(camera.fx > 0 && camera.fy > 0)) {
    io::bad_file(file, place + "fx, fy", std::to_string(camera.fx) + ", " + std::to_string(camera.fy),
                 "focal lengths > 0");
  }
  for (const auto& [key, field] : {std::pair{"width", &camera.width}, {"height", &camera.height}}) {
    if (!object.contains(prefix + key)) continue;
    const double value = number(file, place, object, (prefix + key).c_str());
    if (!(value >= 1 && value <= 65535) || value != std::floor(value)) {
      io::bad_file(file, place + key, std::to_string(value), "a whole number of pixels in 1..65535");
    }
    *field = static_cast<int>(value);
  }
  if (object.contains("depth_scale")) result.depth_scale_mm = number(file, place, object, "depth_scale");
  if (object.contains("depth_unit")) {
    const json& unit = object.at("depth_unit");
    if (unit != "mm" && unit != "m")
      io::bad_file(file, place + "depth_unit", io::in_quotes(unit.dump()), "\"mm\" or \"m\"");
    result.depth_scale_mm = (unit == "m" ? 1000.0 : 1.0) * result.depth_scale_mm.value_or(1.0);
  }
  if (result.depth_scale_mm && !(*result.depth_scale_mm > 0)) {
    io::bad_file(file, place + "depth_scale", std::to_string(*result.depth_scale_mm), "millimetres per step, > 0");
  }
  if (object.contains("distortion")) {
    const json& d = object.at("distortion");
    if (!d.is_array() || d.size() > 5)
      io::bad_file(file, place + "distortion", io::in_quotes(d.dump()), "[k1, k2, p1, p2, k3]");
    for (std::size_t i = 0; i < d.size(); ++i) {
      if (!d[i].is_number())
        io::bad_file(file, place + "distortion", io::in_quotes(d[i].dump()), "[k1, k2, p1, p2, k3]");
      result.distortion[i] = d[i].get<double>();
    }
  }
  NoiseProfile& noise = result.noise;
  for (const auto& [key, field] : {std::pair{"noise_mm", &noise.sigma_mm},
                                   {"noise_correlation_px", &noise.correlation_px},
                                   {"scale_error", &noise.scale_error},
                                   {"shape_error", &noise.shape_error},
                                   {"offset_mm", &noise.offset_mm}}) {
    if (!object.contains(key)) continue;
    *field = number(file, place, object, key);
    if (!(*field >= 0)) io::bad_file(file, place + key, std::to_string(*field), "a number >= 0");
  }
  return result;
}

bool is_scene_camera(const json& top) {
  if (top.empty() || top.contains("cam_K")) return false;
  return top.begin().key().find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

bool CameraFile::distorted() const {
  for (double d : distortion) {
    if (d != 0) return true;
  }
  return false;
}

CameraFile read_camera_file(const std::filesystem::path& path, int image_id) {
  const io::FileBytes file = io::read_file(path);
  json top;
  try {
    top = json::parse(file.data);
  } catch (const json::parse_error& error) {
    io::bad_file(file.name, io::at_line(file.view(), error.byte), "text that is no JSON", "a camera file (JSON)");
  }
  if (!top.is_object()) io::bad_file(file.name, "top level", io::in_quotes(top.dump()), "a JSON object");
  if (!is_scene_camera(top)) return from_object(file.name, "", top);
  const std::string key = std::to_string(image_id);
  if (!top.contains(key) || !top.at(key).is_object()) {
    io::bad_file(file.name, "top level", "no camera of image " + key,
                 "an entry for each image (BOP scene_camera.json)");
  }
  return from_object(file.name, key + ".", top.at(key));
}

void write_camera_file(const std::filesystem::path& path, const CameraFile& file) {
  const PinholeCamera& c = file.camera;
  nlohmann::ordered_json out;
  out["cam_K"] = {c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0};
  if (file.depth_scale_mm) out["depth_scale"] = *file.depth_scale_mm;
  out["width"] = c.width;
  out["height"] = c.height;
  if (file.distorted()) out["distortion"] = file.distortion;
  if (file.noise.sigma_mm > 0) out["noise_mm"] = file.noise.sigma_mm;
  if (file.noise.correlation_px >= 0) out["noise_correlation_px"] = file.noise.correlation_px;
  if (file.noise.scale_error > 0) out["scale_error"] = file.noise.scale_error;
  if (file.noise.shape_error > 0) out["shape_error"] = file.noise.shape_error;
  if (file.noise.offset_mm > 0) out["offset_mm"] = file.noise.offset_mm;
  io::write_file(path, out.dump(2) + "\n");
}

Image<Vec3f> undistorted_rays(const CameraFile& file) {
  const PinholeCamera& c = file.camera;
  Image<Vec3f> rays(c.width, c.height, Vec3f::Zero());
  parallel_ranges(c.height, 64, [&](int begin, int end) {
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < c.width; ++u) {
        const Vec3 seen = c.ray(u, v);
        const std::optional<Vec2> ideal = undistorted(file.distortion, {seen.x(), seen.y()});
        if (!ideal) {
          throw Error(ErrorCode::out_of_range, "distortion: pixel " + std::to_string(u) + ", " + std::to_string(v) +
                                                   " has no single ray: saw a model that folds the image, wanted one "
                                                   "that holds up to its corners");
        }
        rays(u, v) = Vec3f(static_cast<float>(ideal->x()), static_cast<float>(ideal->y()), 1.0f);
      }
    }
  });
  return rays;
}

}  // namespace tribin
