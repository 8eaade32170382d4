#include "report/png.hpp"

#include <png.h>

#include <bit>
#include <csetjmp>
#include <fstream>

#include "tribin/core/error.hpp"
#include "tribin/report/label_png.hpp"
#include "tribin/report/page_kit.hpp"

namespace tribin::report {
namespace {

void append(png_structp png, png_bytep data, png_size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}
void no_flush(png_structp) {}

struct Header {
  int width, height, depth, colour;
  const std::vector<Rgb>* palette = nullptr;
};

/// \param rows  height pointers. No C++ object is made between setjmp and the end: libpng leaves by longjmp.
void encode(const Header& header, const png_byte* const* rows, std::string& out) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  TRIBIN_ASSERT(png && info);
  if (setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    assertion_failed("libpng encodes the picture", __FILE__, __LINE__);
  }
  png_set_write_fn(png, &out, append, no_flush);
  png_set_IHDR(png, info, header.width, header.height, header.depth, header.colour, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 9);
  if (header.palette) {
    png_color colours[256];
    for (std::size_t i = 0; i < header.palette->size(); ++i)
      colours[i] = {(*header.palette)[i][0], (*header.palette)[i][1], (*header.palette)[i][2]};
    png_set_PLTE(png, info, colours, static_cast<int>(header.palette->size()));
    const png_byte clear = 0;
    png_set_tRNS(png, info, &clear, 1, nullptr);
    png_set_filter(png, 0, PNG_FILTER_NONE);
  }
  png_write_info(png, info);
  if (header.depth == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  for (int v = 0; v < header.height; ++v) png_write_row(png, rows[v]);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
}

template <class T>
std::vector<const png_byte*> rows_of(const Image<T>& image) {
  std::vector<const png_byte*> rows(image.height);
  for (int v = 0; v < image.height; ++v) rows[v] = reinterpret_cast<const png_byte*>(image.row(v));
  return rows;
}

}  // namespace

std::string png_of(const Image<std::uint8_t>& indices, const std::vector<Rgb>& palette) {
  TRIBIN_ASSERT(!palette.empty() && palette.size() <= 256);
  std::string out;
  const auto rows = rows_of(indices);
  encode({indices.width, indices.height, 8, PNG_COLOR_TYPE_PALETTE, &palette}, rows.data(), out);
  return out;
}

std::string png_of(const Image<std::uint16_t>& grey) {
  std::string out;
  const auto rows = rows_of(grey);
  encode({grey.width, grey.height, 16, PNG_COLOR_TYPE_GRAY}, rows.data(), out);
  return out;
}

std::string base64(const std::string& bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t block = 0;
    for (std::size_t k = 0; k < 3; ++k)
      block = block << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[block >> (18 - 6 * k) & 63];
  }
  return out;
}

}  // namespace tribin::report

namespace tribin {

void write_label_png(const std::filesystem::path& path, const Image<std::uint16_t>& labels) {
  std::ofstream file(path, std::ios::binary);
  file << report::png_of(labels);
  file.close();
  if (!file) throw Error(ErrorCode::bad_option, path.string() + ": cannot be written");
}

}  // namespace tribin
