#include "io/raw_cloud.hpp"

#ifdef TRIBIN_HAS_TIFF

#include <tiffio.h>

#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include "io/binary.hpp"

namespace tribin::io {
namespace {

struct Memory {
  std::string_view bytes;
  std::size_t at = 0;
  std::string message;
};

tmsize_t on_read(thandle_t handle, void* out, tmsize_t count) {
  auto* memory = static_cast<Memory*>(handle);
  const std::size_t left = memory->at < memory->bytes.size() ? memory->bytes.size() - memory->at : 0;
  const std::size_t n = std::min(left, static_cast<std::size_t>(count));
  std::memcpy(out, memory->bytes.data() + std::min(memory->at, memory->bytes.size()), n);
  memory->at += n;
  return static_cast<tmsize_t>(n);
}

tmsize_t on_write(thandle_t, void*, tmsize_t) { return 0; }

toff_t on_seek(thandle_t handle, toff_t offset, int whence) {
  auto* memory = static_cast<Memory*>(handle);
  const std::size_t base = whence == SEEK_CUR ? memory->at : whence == SEEK_END ? memory->bytes.size() : 0;
  return memory->at = base + offset;
}

int on_close(thandle_t) { return 0; }
toff_t on_size(thandle_t handle) { return static_cast<Memory*>(handle)->bytes.size(); }

int on_error(TIFF*, void* user, const char*, const char* format, va_list arguments) {
  char text[200];
  std::vsnprintf(text, sizeof text, format, arguments);
  auto* memory = static_cast<Memory*>(user);
  if (memory->message.empty()) memory->message = text;
  return 1;
}

int on_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

}  // namespace

RawArray parse_tiff(const FileBytes& file) {
  Memory memory{file.view(), 0, {}};
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                             TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, &memory);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, &memory);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), 1 << 29);
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(
      TIFFClientOpenExt("scan", "rm", &memory, on_read, on_write, on_seek, on_close, on_size, nullptr, nullptr,
                        options.get()),
      TIFFClose);
  const auto fail = [&](const std::string& seen, const std::string& wanted) {
    bad_file(file.name, "first image", memory.message.empty() ? seen : memory.message, wanted);
  };
  if (!tiff) fail(in_quotes(file.view().substr(0, 4)), "a TIFF file");
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, channels = 1, format = SAMPLEFORMAT_UINT, planar = PLANARCONFIG_CONTIG;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &channels);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &planar);
  const bool floats = bits == 32 && format == SAMPLEFORMAT_IEEEFP && (channels == 1 || channels == 3);
  const bool steps = bits == 16 && format == SAMPLEFORMAT_UINT && channels == 1;
  if (!(floats || steps) || (channels > 1 && planar != PLANARCONFIG_CONTIG) || TIFFIsTiled(tiff.get())) {
    fail(std::to_string(channels) + " channels of " + std::to_string(bits) + " bits, format " + std::to_string(format) +
             (TIFFIsTiled(tiff.get()) ? ", in tiles" : ""),
         "16-bit grey, 32-bit float depth, or 3 channels of float (X, Y, Z side by side), in strips");
  }
  // No codec of libtiff packs better than zlib's 1032 : 1 by more than a small factor on a depth image.
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  const std::size_t row_bytes = static_cast<std::size_t>(width) * channels * bits / 8;
  if (pixels == 0 || width > 65535 || height > 65535 || pixels > kMaxPoints ||
      row_bytes * height > file.size() * 4096) {
    fail("an image of " + std::to_string(width) + " x " + std::to_string(height) + " in " +
             std::to_string(file.size()) + " bytes",
         "a size that the file can hold");
  }
  if (static_cast<std::size_t>(TIFFScanlineSize(tiff.get())) != row_bytes)
    fail("rows of another size", "rows of " + std::to_string(row_bytes) + " bytes");
  RawArray array{static_cast<int>(width), static_cast<int>(height), channels, false, {}};
  array.values.resize(pixels * channels);
  std::vector<char> row(row_bytes);
  for (std::uint32_t v = 0; v < height; ++v) {
    if (TIFFReadScanline(tiff.get(), row.data(), v) < 0) fail("a broken row " + std::to_string(v), "a whole image");
    float* out = array.values.data() + static_cast<std::size_t>(v) * width * channels;
    for (std::size_t i = 0; i < static_cast<std::size_t>(width) * channels; ++i) {
      out[i] = floats ? load<float>(row.data() + 4 * i) : load<std::uint16_t>(row.data() + 2 * i);
    }
  }
  return array;
}

}  // namespace tribin::io

#else

namespace tribin::io {

RawArray parse_tiff(const FileBytes& file) {
  throw Error(ErrorCode::bad_option,
              file.name + ": TIFF is not built in: install libtiff-dev and build again, or save PNG or NPY");
}

}  // namespace tribin::io

#endif
