#include "io/ply_header.hpp"

#include "io/text_cursor.hpp"

namespace tribin::io {
namespace {

Scalar scalar_of(const FileBytes& file, const std::string& place, std::string_view name) {
  constexpr std::pair<std::string_view, Scalar> kNames[] = {
      {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
      {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
      {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
      {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64}};
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  bad_file(file.name, place, in_quotes(name), "a PLY type (char .. double)");
}

/// "num_cols 640", "width 640", "width: 640", "width = 640" in a comment or obj_info.
void read_grid_size(const std::vector<std::string_view>& words, PlyHeader& header) {
  for (std::size_t i = 1; i + 1 < words.size(); ++i) {
    std::string_view key = words[i];
    std::string_view value = words[i + 1];
    if (value == "=" || value == ":") value = i + 2 < words.size() ? words[i + 2] : value;
    if (key.ends_with(':') || key.ends_with('=')) key.remove_suffix(1);
    std::size_t number = 0;
    if (!whole_number(value, number) || number > kMaxPoints) continue;
    if (key == "num_cols" || key == "width") header.columns = number;
    if (key == "num_rows" || key == "height") header.rows = number;
  }
}

void check_counts(const FileBytes& file, const PlyHeader& header) {
  const std::size_t left = file.size() - header.body;
  std::size_t least = 0;
  for (const PlyElement& element : header.elements) {
    // A number in text takes a digit and a space. An element without properties takes a line, or nothing in binary.
    const bool ascii = header.format == PlyHeader::Format::ascii;
    const std::size_t each = std::max<std::size_t>(ascii ? 2 * element.properties.size() : element.least_bytes(), 1);
    if (element.count > (left + 1) / each || (least += element.count * each) > left + 1) {
      bad_file(file.name, "element " + in_quotes(element.name),
               std::to_string(element.count) + " of them in " + std::to_string(left) + " bytes",
               "a count that the file can hold (at least " + std::to_string(each) + " bytes each)");
    }
  }
}

}  // namespace

std::size_t PlyElement::least_bytes() const {
  std::size_t bytes = 0;
  for (const PlyProperty& p : properties) bytes += size_of(p.is_list ? p.count_type : p.type);
  return bytes;
}

bool PlyElement::has_list() const {
  for (const PlyProperty& p : properties) {
    if (p.is_list) return true;
  }
  return false;
}

int PlyElement::find(std::string_view property) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property) return static_cast<int>(i);
  }
  return -1;
}

PlyHeader parse_ply_header(const FileBytes& file) {
  PlyHeader header;
  TextCursor cursor(file);
  std::string_view line;
  std::string place = "line 1";
  if (!cursor.next_line(line) || words_of(line) != std::vector<std::string_view>{"ply"}) {
    bad_file(file.name, "line 1", in_quotes(line), "\"ply\"");
  }
  bool has_format = false;
  for (;;) {
    place = cursor.place();
    if (!cursor.next_line(line)) bad_file(file.name, place, "the end of the file", "end_header");
    const auto words = words_of(line);
    if (words.empty()) continue;
    if (words[0] == "end_header") break;
    if (words[0] == "comment" || words[0] == "obj_info") {
      read_grid_size(words, header);
    } else if (words[0] == "format" && words.size() >= 2) {
      using enum PlyHeader::Format;
      if (words[1] == "ascii")
        header.format = ascii;
      else if (words[1] == "binary_little_endian")
        header.format = binary_little_endian;
      else if (words[1] == "binary_big_endian")
        header.format = binary_big_endian;
      else
        bad_file(file.name, place, in_quotes(line), "ascii, binary_little_endian or binary_big_endian");
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      PlyElement element{std::string(words[1]), 0, {}};
      if (!whole_number(words[2], element.count)) bad_file(file.name, place, in_quotes(line), "a count >= 0");
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && !header.elements.empty() && words.size() == 3) {
      header.elements.back().properties.push_back({std::string(words[2]), scalar_of(file, place, words[1]), false, {}});
    } else if (words[0] == "property" && !header.elements.empty() && words.size() == 5 && words[1] == "list") {
      const Scalar count_type = scalar_of(file, place, words[2]), type = scalar_of(file, place, words[3]);
      if (count_type == Scalar::f32 || count_type == Scalar::f64) {
        bad_file(file.name, place, in_quotes(line), "a list whose count is a whole number");
      }
      header.elements.back().properties.push_back({std::string(words[4]), type, true, count_type});
    } else {
      bad_file(file.name, place, in_quotes(line), "format, element, property, comment, obj_info or end_header");
    }
  }
  if (!has_format) bad_file(file.name, place, "no format line", "\"format ascii 1.0\" or a binary one");
  header.body = cursor.position();
  check_counts(file, header);
  return header;
}

}  // namespace tribin::io
