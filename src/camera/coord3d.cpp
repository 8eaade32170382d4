#include "tribin/camera/coord3d.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "io/raw_cloud.hpp"

namespace tribin {
namespace {

constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

struct Layout {
  std::size_t channels = 3, word = 4;
  bool planar = false;
};
Layout layout_of(Coord3dFormat format) {
  switch (format) {
    case Coord3dFormat::abc32f:
      return {3, 4, false};
    case Coord3dFormat::abc32f_planar:
      return {3, 4, true};
    case Coord3dFormat::abc16:
      return {3, 2, false};
    case Coord3dFormat::c32f:
      return {1, 4, false};
    case Coord3dFormat::c16:
      return {1, 2, false};
  }
  return {};
}

/// Raw values by pixel and channel.
class Reader {
 public:
  explicit Reader(const Coord3dImage& image)
      : data_(image.data.data()), layout_(layout_of(image.format)), pixels_(std::size_t(image.width) * image.height) {}

  double operator()(std::size_t pixel, std::size_t channel) const {
    const std::size_t place = layout_.planar ? channel * pixels_ + pixel : pixel * layout_.channels + channel;
    const std::byte* at = data_ + place * layout_.word;
    if (layout_.word == 2) {
      std::uint16_t value;
      std::memcpy(&value, at, sizeof value);
      return value;
    }
    float value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }

 private:
  const std::byte* data_;
  Layout layout_;
  std::size_t pixels_;
};

Scan depth_scan(const Coord3dImage& image, const Reader& raw, const std::string& source) {
  if (!(image.camera.fx > 0 && image.camera.fy > 0))
    io::bad_file(source, "Scan3dFocalLength", "none, with depths alone", "it, or x and y too (Coord3D_ABC32f)");
  Scan scan;
  scan.source = source;
  scan.camera = image.camera;
  scan.camera.width = image.width, scan.camera.height = image.height;
  scan.z_mm = Image<float>(image.width, image.height, kHole);
  for (std::size_t i = 0; i < scan.z_mm.size(); ++i) {
    const double c = raw(i, 0), z = (image.scale[2] * c + image.offset[2]) * image.unit_mm;
    if (std::isfinite(c) && c != image.invalid_value && z > 0) scan.z_mm.data[i] = static_cast<float>(z);
  }
  if (valid_count(scan) == 0)
    io::bad_file(source, "", "no pixel with a depth", "a scan with measurements", ErrorCode::too_little_data);
  return scan;
}

}  // namespace

std::size_t coord3d_bytes(Coord3dFormat format, int width, int height) {
  const Layout layout = layout_of(format);
  return std::size_t(width) * std::size_t(height) * layout.channels * layout.word;
}

Scan scan_from_coord3d(const Coord3dImage& image, const std::string& source) {
  const std::size_t wanted = coord3d_bytes(image.format, image.width, image.height);
  if (image.data.size() < wanted)
    io::bad_file(source, "", std::to_string(image.data.size()) + " bytes of points",
                 std::to_string(wanted) + " for " + std::to_string(image.width) + " x " + std::to_string(image.height),
                 ErrorCode::device);
  const Reader raw(image);
  if (layout_of(image.format).channels == 1) return depth_scan(image, raw, source);
  io::RawCloud cloud;
  cloud.name = source;
  cloud.width = image.width, cloud.height = image.height;
  cloud.points.resize(std::size_t(image.width) * image.height, Vec3f::Constant(kHole));
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vec3 abc(raw(i, 0), raw(i, 1), raw(i, 2));
    if (!abc.allFinite() || abc.z() == image.invalid_value || (image.invalid_value == 0.0 && abc.isZero())) continue;
    for (int k = 0; k < 3; ++k)
      cloud.points[i][k] = static_cast<float>((image.scale[k] * abc[k] + image.offset[k]) * image.unit_mm);
  }
  return io::scan_from_cloud(std::move(cloud), {.camera_file = {}, .image_id = -1, .unit = LengthUnit::millimetre});
}

}  // namespace tribin
