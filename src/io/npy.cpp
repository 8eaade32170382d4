#include <cmath>

#include "io/binary.hpp"
#include "io/raw_cloud.hpp"
#include "io/text_cursor.hpp"

namespace tribin::io {
namespace {

/// The text behind 'key': in the header, which is a Python dict.
std::string_view value_of(const FileBytes& file, std::string_view header, std::string_view key) {
  const std::size_t at = header.find(std::string("'") + std::string(key) + "'");
  const std::size_t colon = at == header.npos ? at : header.find(':', at);
  if (colon == header.npos) bad_file(file.name, "header", in_quotes(header), "the key " + std::string(key));
  std::string_view value = header.substr(colon + 1);
  while (!value.empty() && TextCursor::is_space(value[0])) value.remove_prefix(1);
  return value;
}

Scalar scalar_of(const FileBytes& file, std::string_view type, bool& swapped) {
  constexpr std::pair<std::string_view, Scalar> kTypes[] = {
      {"f4", Scalar::f32}, {"f8", Scalar::f64}, {"u2", Scalar::u16}, {"i2", Scalar::i16},
      {"u4", Scalar::u32}, {"i4", Scalar::i32}, {"i8", Scalar::i64}, {"u8", Scalar::u64}};
  if (type.size() >= 4 && type[0] == '\'') {
    swapped = (type[1] == '>') != kBigEndianHost;
    for (const auto& [name, scalar] : kTypes) {
      if (type.substr(2, 2) == name) return scalar;
    }
  }
  bad_file(file.name, "descr", in_quotes(type.substr(0, 6)), "floats or integers ('<f4', '<f8', '<u2' ..)");
}

std::vector<std::size_t> shape_of(const FileBytes& file, std::string_view text) {
  std::vector<std::size_t> shape;
  const std::size_t close = text.find(')');
  if (text.empty() || text[0] != '(' || close == text.npos)
    bad_file(file.name, "shape", in_quotes(text), "(H, W) or such");
  std::string_view inside = text.substr(1, close - 1);
  while (!inside.empty()) {
    const std::size_t comma = std::min(inside.find(','), inside.size());
    std::string_view word = inside.substr(0, comma);
    while (!word.empty() && word[0] == ' ') word.remove_prefix(1);
    while (!word.empty() && word.back() == ' ') word.remove_suffix(1);
    std::size_t n = 0;
    if (!word.empty()) {
      if (!whole_number(word, n) || n > kMaxPoints * 3)
        bad_file(file.name, "shape", in_quotes(text.substr(0, close + 1)), "sizes that make sense");
      shape.push_back(n);
    }
    inside.remove_prefix(std::min(comma + 1, inside.size()));
  }
  return shape;
}

}  // namespace

RawArray parse_npy(const FileBytes& file) {
  const std::string_view bytes = file.view();
  if (!bytes.starts_with("\x93NUMPY") || bytes.size() < 12) {
    bad_file(file.name, "byte 0", in_quotes(bytes.substr(0, 6)), "the signature of NPY (np.save)");
  }
  const bool long_header = bytes[6] >= 2;
  const std::size_t length = long_header ? load<std::uint32_t>(bytes.data() + 8, kBigEndianHost)
                                         : load<std::uint16_t>(bytes.data() + 8, kBigEndianHost);
  const std::size_t begin = long_header ? 12 : 10;
  if (length > bytes.size() - begin) {
    bad_file(file.name, "byte 8", "a header of " + std::to_string(length) + " bytes", "one that the file can hold");
  }
  const std::string_view header = bytes.substr(begin, length);
  bool swapped = false;
  const Scalar type = scalar_of(file, value_of(file, header, "descr"), swapped);
  if (!value_of(file, header, "fortran_order").starts_with("False")) {
    bad_file(file.name, "fortran_order", "True", "row by row (np.save of np.ascontiguousarray)");
  }
  const std::vector<std::size_t> shape = shape_of(file, value_of(file, header, "shape"));
  RawArray array;
  const std::size_t rank = shape.size();
  array.list = rank == 2 && shape[1] == 3;
  if (rank < 2 || rank > 3 || (rank == 3 && shape[2] != 1 && shape[2] != 3)) {
    bad_file(file.name, "shape", in_quotes(value_of(file, header, "shape").substr(0, 40)),
             "(H, W), (H, W, 1), (H, W, 3) or (N, 3)");
  }
  array.channels = array.list ? 3 : rank == 3 ? static_cast<int>(shape[2]) : 1;
  const std::size_t width = array.list ? shape[0] : shape[1], height = array.list ? 1 : shape[0];
  if (width == 0 || height == 0) bad_file(file.name, "shape", "an empty array", "points", ErrorCode::too_little_data);
  if ((!array.list && (width > 65535 || height > 65535)) || width * height > kMaxPoints) {
    bad_file(file.name, "shape", std::to_string(width) + " x " + std::to_string(height),
             "at most 65535 a side and 100 million points");
  }
  const std::size_t count = width * height * array.channels;
  const std::size_t data = begin + length;
  if (count * size_of(type) > bytes.size() - data) {
    bad_file(file.name, "shape", std::to_string(count) + " values in " + std::to_string(bytes.size() - data) + " bytes",
             std::to_string(count * size_of(type)) + " bytes for them");
  }
  array.width = static_cast<int>(width);
  array.height = static_cast<int>(height);
  array.values.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    array.values[i] = static_cast<float>(load_scalar(bytes.data() + data + i * size_of(type), type, swapped));
  }
  return array;
}

std::string encode_npy(const RawArray& array) {
  std::string shape = std::to_string(array.height) + ", " + std::to_string(array.width);
  if (array.channels > 1) shape += ", " + std::to_string(array.channels);
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + shape + "), }";
  constexpr std::size_t kBefore = 10, kAligned = 64;  // magic, version and length; the data begin at a multiple of 64
  header.append(kAligned - (kBefore + header.size() + 1) % kAligned, ' ').append("\n");
  std::string out("\x93NUMPY\x01\x00", 8);
  append(out, static_cast<std::uint16_t>(header.size()));
  out += header;
  for (const float value : array.values) append(out, value);
  return out;
}

RawCloud cloud_from_array(const FileBytes& file, RawArray array) {
  RawCloud cloud{.name = file.name,
                 .width = array.width,
                 .height = array.height,
                 .points = {},
                 .viewpoint = {},
                 .taken = {},
                 .warnings = {}};
  cloud.points.resize(array.values.size() / 3);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    cloud.points[i] = Vec3f(array.values[3 * i], array.values[3 * i + 1], array.values[3 * i + 2]);
  }
  return cloud;
}

}  // namespace tribin::io
