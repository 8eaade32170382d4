#include "genicam/buffers.hpp"

#include <cstdio>
#include <cstring>

namespace tribin::genicam {
namespace {

struct Part {
  ArvPixelFormat format = 0;
  int width = 0, height = 0;
  int row_padding = 0;  ///< bytes behind each row
  const std::byte* data = nullptr;
  std::size_t size = 0;
};

Part part_of(ArvBuffer* buffer, guint index) {
  Part part;
  gint below = 0;
  part.format = arv_buffer_get_part_pixel_format(buffer, index);
  part.width = arv_buffer_get_part_width(buffer, index);
  part.height = arv_buffer_get_part_height(buffer, index);
  arv_buffer_get_part_padding(buffer, index, &part.row_padding, &below);
  part.data = static_cast<const std::byte*>(arv_buffer_get_part_data(buffer, index, &part.size));
  return part;
}

Part whole(ArvBuffer* buffer) {
  Part part;
  gint below = 0;
  part.format = arv_buffer_get_image_pixel_format(buffer);
  part.width = arv_buffer_get_image_width(buffer);
  part.height = arv_buffer_get_image_height(buffer);
  arv_buffer_get_image_padding(buffer, &part.row_padding, &below);
  part.data = static_cast<const std::byte*>(arv_buffer_get_image_data(buffer, &part.size));
  return part;
}

std::vector<Part> parts_of(ArvBuffer* buffer) {
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_MULTIPART) return {whole(buffer)};
  std::vector<Part> parts;
  for (guint i = 0; i < arv_buffer_get_n_parts(buffer); ++i) parts.push_back(part_of(buffer, i));
  return parts;
}

std::string name_of(ArvPixelFormat format) {
  char text[32];
  std::snprintf(text, sizeof text, "pixel format 0x%08X", format);
  return text;
}

/// The largest value of a grey format, 0 for others.
int full_scale_of(ArvPixelFormat format) {
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_8:
      return 255;
    case ARV_PIXEL_FORMAT_MONO_10:
      return 1023;
    case ARV_PIXEL_FORMAT_MONO_12:
      return 4095;
    case ARV_PIXEL_FORMAT_MONO_14:
      return 16383;
    case ARV_PIXEL_FORMAT_MONO_16:
      return 65535;
    default:
      return 0;
  }
}

std::optional<Coord3dFormat> coord3d_of(ArvPixelFormat format) {
  switch (format) {
    case ARV_PIXEL_FORMAT_COORD3D_ABC_32F:
      return Coord3dFormat::abc32f;
    case ARV_PIXEL_FORMAT_COORD3D_ABC_32F_PLANAR:
      return Coord3dFormat::abc32f_planar;
    case ARV_PIXEL_FORMAT_COORD3D_ABC_16:
      return Coord3dFormat::abc16;
    case ARV_PIXEL_FORMAT_COORD3D_C_32F:
      return Coord3dFormat::c32f;
    case ARV_PIXEL_FORMAT_COORD3D_C_16:
      return Coord3dFormat::c16;
    default:
      return {};
  }
}

template <class T>
Image<T> picture_of(const std::string& name, const Part& part) {
  const std::size_t row = std::size_t(part.width) * sizeof(T), step = row + std::size_t(part.row_padding);
  const std::size_t wanted = part.height > 0 ? step * (std::size_t(part.height) - 1) + row : 0;
  if (part.width <= 0 || part.height <= 0 || part.size < wanted)
    throw Error(ErrorCode::device, name + ": saw a picture of " + std::to_string(part.width) + " x " +
                                       std::to_string(part.height) + " in " + std::to_string(part.size) +
                                       " bytes, wanted " + std::to_string(wanted));
  Image<T> image(part.width, part.height);
  for (int v = 0; v < part.height; ++v) std::memcpy(image.row(v), part.data + std::size_t(v) * step, row);
  return image;
}

/// Scan3d features of a camera, those of the buffer's chunks first. What a camera does not have is the fallback.
class Scan3d {
 public:
  Scan3d(ArvCamera* camera, ArvBuffer* buffer) : camera_(camera), buffer_(buffer) {
    if (arv_buffer_has_chunks(buffer)) chunks_.reset(arv_camera_create_chunk_parser(camera));
  }

  double number(const std::string& feature, double fallback) {
    if (chunks_) {
      GError* error = nullptr;
      const double value =
          arv_chunk_parser_get_float_value(chunks_.get(), buffer_, ("Chunk" + feature).c_str(), &error);
      if (!error) return value;
      g_clear_error(&error);
    }
    if (!has(feature)) return fallback;
    GError* error = nullptr;
    const double value = arv_camera_get_float(camera_, feature.c_str(), &error);
    if (!error) return value;
    g_clear_error(&error);
    return fallback;
  }

  bool flag(const char* feature) {
    GError* error = nullptr;
    const bool value = has(feature) && arv_camera_get_boolean(camera_, feature, &error);
    g_clear_error(&error);
    return value;
  }

  /// Of the coordinate, "CoordinateA" ..; cameras without the selector have one value for all.
  void select(const char* coordinate) {
    for (const char* selector : {"Scan3dCoordinateSelector", "ChunkScan3dCoordinateSelector"}) {
      GError* error = nullptr;
      if (has(selector)) arv_camera_set_string(camera_, selector, coordinate, &error);
      g_clear_error(&error);
    }
  }

  double unit_mm() {
    if (!has("Scan3dDistanceUnit")) return 1;
    GError* error = nullptr;
    const char* unit = arv_camera_get_string(camera_, "Scan3dDistanceUnit", &error);
    const std::string text = unit && !error ? unit : "";
    g_clear_error(&error);
    return text == "Meter" ? 1000 : text == "Inch" ? 25.4 : 1;
  }

 private:
  bool has(const std::string& feature) {
    GError* error = nullptr;
    const bool available = arv_camera_is_feature_available(camera_, feature.c_str(), &error);
    g_clear_error(&error);
    return available;
  }

  ArvCamera* camera_;
  ArvBuffer* buffer_;
  Owned<ArvChunkParser> chunks_;
};

}  // namespace

void append_picture(const std::string& name, ArvBuffer* buffer, FrameStack& stack) {
  const Part part = parts_of(buffer).at(0);
  const int full_scale = full_scale_of(part.format);
  if (full_scale == 0)
    throw Error(ErrorCode::bad_input,
                name + ": saw " + name_of(part.format) + ", wanted Mono8, Mono10, Mono12 or Mono16 (unpacked)");
  if (full_scale == 255) {
    stack.grey8.push_back(picture_of<std::uint8_t>(name, part));
  } else {
    stack.grey16.push_back(picture_of<std::uint16_t>(name, part));
    stack.full_scale = full_scale;
  }
}

Scan scan_of_buffer(const std::string& name, ArvCamera* camera, ArvBuffer* buffer) {
  std::string seen;
  for (const Part& part : parts_of(buffer)) {
    const std::optional<Coord3dFormat> format = coord3d_of(part.format);
    seen += (seen.empty() ? "" : ", ") + name_of(part.format);
    if (!format) continue;
    Scan3d features(camera, buffer);
    Coord3dImage image;
    image.format = *format;
    image.width = part.width, image.height = part.height;
    image.data = {part.data, part.size};
    constexpr const char* kCoordinates[] = {"CoordinateA", "CoordinateB", "CoordinateC"};
    for (std::size_t k = 0; k < 3; ++k) {
      features.select(kCoordinates[k]);
      image.scale[k] = features.number("Scan3dCoordinateScale", 1);
      image.offset[k] = features.number("Scan3dCoordinateOffset", 0);
    }
    if (features.flag("Scan3dInvalidDataFlag")) image.invalid_value = features.number("Scan3dInvalidDataValue", 0);
    image.unit_mm = features.unit_mm();
    image.camera.fx = image.camera.fy = features.number("Scan3dFocalLength", 0);
    image.camera.cx = features.number("Scan3dPrincipalPointU", 0);
    image.camera.cy = features.number("Scan3dPrincipalPointV", 0);
    return scan_from_coord3d(image, name);
  }
  throw Error(ErrorCode::bad_input, name + ": saw " + seen +
                                        ", wanted points (Coord3D_ABC32f, ABC16, C32f or C16); "
                                        "cameras of pictures want --patterns");
}

}  // namespace tribin::genicam
