#include "io/png.hpp"

#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <vector>

namespace tribin::io {
namespace {

struct Reading {
  std::string_view bytes;
  std::size_t at = 0;
  char message[200] = "";
};

void on_error(png_structp png, png_const_charp text) {
  auto* reading = static_cast<Reading*>(png_get_error_ptr(png));
  std::strncpy(reading->message, text, sizeof reading->message - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}  // ancillary chunks; what matters is an error

void on_read(png_structp png, png_bytep out, std::size_t count) {
  auto* reading = static_cast<Reading*>(png_get_io_ptr(png));
  if (count > reading->bytes.size() - reading->at) png_error(png, "the end of the file");
  std::memcpy(out, reading->bytes.data() + reading->at, count);
  reading->at += count;
}

void on_write(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), count);
}

std::uint32_t big_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// libpng reports errors by longjmp, which runs no destructors: nothing here owns memory but libpng itself.
bool decode(Reading& reading, png_bytep* rows) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reading, on_error, on_warning);
  if (!png) return false;
  png_infop info = png_create_info_struct(png);
  if (setjmp(png_jmpbuf(png))) {
    png_destroy_read_struct(&png, &info, nullptr);
    return false;
  }
  png_set_read_fn(png, &reading, on_read);
  png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_WARN_DISCARD);
  png_read_info(png, info);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  png_destroy_read_struct(&png, &info, nullptr);
  return true;
}

/// What a PNG's header says.
struct Header {
  int width = 0, height = 0, depth = 0, type = 0;
};

Header read_header(const FileBytes& file) {
  static constexpr char kSignature[] = "\x89PNG\r\n\x1a\n";
  const std::string_view bytes = file.view();
  if (bytes.substr(0, 8) != std::string_view(kSignature, 8)) {
    bad_file(file.name, "byte 0", in_quotes(bytes.substr(0, 8)), "a PNG signature");
  }
  if (bytes.size() < 33 || bytes.substr(12, 4) != "IHDR")
    bad_file(file.name, "byte 8", "no header", "a PNG header (IHDR)");
  const std::uint32_t width = big_endian(bytes, 16), height = big_endian(bytes, 20);
  const int depth = static_cast<unsigned char>(bytes[24]), type = static_cast<unsigned char>(bytes[25]);
  // zlib packs at most 1032 : 1, so that a short file cannot hold a large image: nothing is allocated on a false claim.
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  if (width == 0 || height == 0 || width > 65535 || height > 65535 || pixels > kMaxPoints ||
      pixels * static_cast<std::size_t>(depth) / 8 > bytes.size() * 1040) {
    bad_file(file.name, "byte 16",
             "an image of " + std::to_string(width) + " x " + std::to_string(height) + " in " +
                 std::to_string(bytes.size()) + " bytes",
             "a size that the file can hold");
  }
  return {static_cast<int>(width), static_cast<int>(height), depth, type};
}

[[noreturn]] void wrong_kind(const FileBytes& file, const Header& header, const char* wanted) {
  bad_file(file.name, "byte 24",
           std::to_string(header.depth) + " bits a channel, colour type " + std::to_string(header.type), wanted);
}

template <class T>
Image<T> decode_pixels(const FileBytes& file, const Header& header) {
  Image<T> image(header.width, header.height);
  std::vector<png_bytep> rows(static_cast<std::size_t>(header.height));
  for (int v = 0; v < header.height; ++v) rows[static_cast<std::size_t>(v)] = reinterpret_cast<png_bytep>(image.row(v));
  Reading reading{file.view()};
  if (!decode(reading, rows.data())) {
    bad_file(file.name, at_byte(reading.at), reading.message, "a whole PNG image");
  }
  return image;
}

template <class T>
std::string encode_pixels(const Image<T>& image, int channels = 1) {
  std::string out;
  std::vector<png_bytep> rows(image.height);
  for (int v = 0; v < image.height; ++v) {
    rows[v] = reinterpret_cast<png_bytep>(const_cast<T*>(image.row(v)));
  }
  Reading messages;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &messages, on_error, on_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  TRIBIN_ASSERT(info != nullptr);
  if (setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    throw Error(ErrorCode::internal, std::string("PNG writer: ") + messages.message);
  }
  png_set_write_fn(png, &out, on_write, nullptr);
  png_set_IHDR(png, info, image.width / channels, image.height, 8 * sizeof(T),
               channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 3);  // 4 times as fast as the default, 5 % larger
  png_write_info(png, info);
  if constexpr (sizeof(T) == 2 && std::endian::native == std::endian::little) png_set_swap(png);
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

}  // namespace

Image<std::uint16_t> decode_png16(const FileBytes& file) {
  const Header header = read_header(file);
  if (header.depth != 16 || header.type != PNG_COLOR_TYPE_GRAY) wrong_kind(file, header, "16-bit grey (a depth image)");
  return decode_pixels<std::uint16_t>(file, header);
}

GreyImage decode_grey_png(const FileBytes& file) {
  const Header header = read_header(file);
  if ((header.depth != 8 && header.depth != 16) || header.type != PNG_COLOR_TYPE_GRAY)
    wrong_kind(file, header, "grey of 8 or 16 bit (a camera image)");
  if (header.depth == 8) return {decode_pixels<std::uint8_t>(file, header), {}};
  return {{}, decode_pixels<std::uint16_t>(file, header)};
}

std::string encode_png8(const Image<std::uint8_t>& image) { return encode_pixels(image); }
std::string encode_png16(const Image<std::uint16_t>& image) { return encode_pixels(image); }
std::string encode_png16_rgb(const Image<std::uint16_t>& interleaved) { return encode_pixels(interleaved, 3); }

}  // namespace tribin::io
