#include "camera/shot_folder.hpp"

#include "io/atomic_file.hpp"
#include "io/png.hpp"
#include "io/pose_json.hpp"
#include "io/raw_cloud.hpp"
#include "tribin/io/camera_file.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/io/taken_file.hpp"

namespace tribin::camera {
namespace {

namespace fs = std::filesystem;
using io::JsonPlace;

constexpr const char *kFrames = "frames.json", *kDepth = "scan.npy", *kCamera = "camera.json", *kRays = "rays.npy",
                     *kModulation = "modulation.png", *kReason = "invalid_reason.png", *kMore = "scan.json",
                     *kTaken = "taken.json", *kRig = "rig.json";

io::RawArray read_array(const fs::path& path) { return io::parse_npy(io::read_file(path)); }

/// An image that may be absent; it must have the scan's size.
Image<std::uint8_t> read_grey(const fs::path& path, const Image<float>& size) {
  if (!fs::exists(path)) return {};
  io::GreyImage image = io::decode_grey_png(io::read_file(path));
  if (image.grey8.width != size.width || image.grey8.height != size.height)
    io::bad_file(path.string(), "", "another size or depth than the scan",
                 "8 bits of " + std::to_string(size.width) + " x " + std::to_string(size.height));
  return std::move(image.grey8);
}

Scan read_scan_folder(const fs::path& folder) {
  Scan scan;
  scan.source = folder.string();
  io::RawArray depth = read_array(folder / kDepth);
  scan.z_mm.width = depth.width, scan.z_mm.height = depth.height;
  const CameraFile camera = read_camera_file(folder / kCamera);
  if (depth.channels != 1 || camera.camera.width != depth.width || camera.camera.height != depth.height)
    io::bad_file((folder / kDepth).string(), "", "another size than its camera.json",
                 "one depth a pixel of that camera");
  scan.z_mm.data = std::move(depth.values);
  scan.camera = camera.camera;
  scan.noise = camera.noise;
  scan.modulation = read_grey(folder / kModulation, scan.z_mm);
  scan.invalid_reason = read_grey(folder / kReason, scan.z_mm);
  for (const std::uint8_t reason : scan.invalid_reason.data)
    if (reason >= kInvalidReasons)
      io::bad_file((folder / kReason).string(), "", "the value " + std::to_string(reason),
                   "reasons below " + std::to_string(kInvalidReasons));
  if (fs::exists(folder / kRays)) {
    const io::RawArray rays = read_array(folder / kRays);
    if (rays.channels != 3 || rays.width != scan.width() || rays.height != scan.height())
      io::bad_file((folder / kRays).string(), "", "another size than the scan", "three numbers a pixel");
    scan.rays = Image<Vec3f>(rays.width, rays.height, Vec3f::Zero());
    for (std::size_t i = 0; i < scan.rays.size(); ++i)
      scan.rays.data[i] = Vec3f(rays.values[3 * i], rays.values[3 * i + 1], rays.values[3 * i + 2]);
  }
  const io::FileBytes file = io::read_file(folder / kMore);
  const nlohmann::json document = io::parse_json(file, "what else belongs to a recorded scan");
  const JsonPlace top(file.name, document, JsonPlace::kTop);
  // A rotation is normalized when it is read; this one must come back bit by bit.
  const std::vector<double> m = top.at("input_from_camera", "16 numbers").numbers(16, "16 numbers, row-wise");
  for (int i = 0; i < 16; ++i) scan.input_from_camera.matrix()(i / 4, i % 4) = m[static_cast<std::size_t>(i)];
  return scan;
}

void write_scan_folder(const fs::path& folder, const Scan& scan) {
  io::write_file(folder / kDepth, io::encode_npy({scan.width(), scan.height(), 1, false, scan.z_mm.data}));
  CameraFile camera{.camera = scan.camera, .depth_scale_mm = {}, .distortion = {}, .noise = scan.noise};
  camera.camera.width = scan.width(), camera.camera.height = scan.height();
  write_camera_file(folder / kCamera, camera);
  if (!scan.modulation.empty()) io::write_file(folder / kModulation, io::encode_png8(scan.modulation));
  if (!scan.invalid_reason.empty()) io::write_file(folder / kReason, io::encode_png8(scan.invalid_reason));
  if (!scan.rays.empty()) {
    io::RawArray rays{scan.width(), scan.height(), 3, false, {}};
    for (const Vec3f& ray : scan.rays.data) rays.values.insert(rays.values.end(), ray.data(), ray.data() + 3);
    io::write_file(folder / kRays, io::encode_npy(rays));
  }
  nlohmann::ordered_json more;
  for (int i = 0; i < 16; ++i) more["input_from_camera"].push_back(scan.input_from_camera.matrix()(i / 4, i % 4));
  io::write_file(folder / kMore, more.dump() + "\n");
}

}  // namespace

bool is_shot(const fs::path& folder) { return fs::exists(folder / kFrames) || fs::exists(folder / kDepth); }

Shot read_shot(const fs::path& folder, const fs::path& frames_file) {
  Shot shot;
  if (frames_file.empty() && fs::exists(folder / kDepth))
    shot.content = read_scan_folder(folder);
  else
    shot.content = read_frames(folder, frames_file);
  if (fs::exists(folder / kRig)) shot.rig = read_rig(folder / kRig, folder);
  if (fs::exists(folder / kTaken)) shot.taken = read_taken_file(folder / kTaken);
  return shot;
}

void write_shot(const fs::path& folder, const Shot& shot) {
  fs::create_directories(folder);
  if (const auto* scan = std::get_if<Scan>(&shot.content))
    write_scan_folder(folder, *scan);
  else
    write_frames(folder, std::get<std::vector<FrameStack>>(shot.content));
  if (shot.rig) write_rig(folder / kRig, *shot.rig);
  if (shot.taken.known()) write_taken_file(folder / kTaken, shot.taken);
}

}  // namespace tribin::camera
