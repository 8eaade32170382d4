#include "io/opencv_yaml.hpp"

#include <charconv>
#include <cmath>
#include <optional>

namespace tribin::io {
namespace {

std::string_view trimmed(std::string_view s) {
  const std::size_t begin = s.find_first_not_of(" \t\r"), end = s.find_last_not_of(" \t\r");
  return begin == std::string_view::npos ? std::string_view() : s.substr(begin, end - begin + 1);
}

std::optional<double> number_of(std::string_view s) {
  double value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  if (end != s.data() + s.size() && std::string_view(end) != ".") return std::nullopt;
  // "0." is a number for OpenCV; from_chars takes the point with it.
  return value;
}

struct Lines {
  std::string_view text;
  std::size_t at = 0;
  int number = 0;

  bool next(std::string_view& line) {
    if (at >= text.size()) return false;
    const std::size_t end = std::min(text.find('\n', at), text.size());
    line = text.substr(at, end - at);
    at = end + 1;
    ++number;
    return true;
  }
};

/// Splits "key: value"; false where there is no colon.
bool key_and_value(std::string_view line, std::string_view& key, std::string_view& value) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return false;
  key = trimmed(line.substr(0, colon));
  value = trimmed(line.substr(colon + 1));
  return true;
}

/// The numbers between '[' and ']', which may go on over further lines.
std::vector<double> numbers(const std::string& file, const std::string& place, std::string_view first, Lines& lines) {
  std::string all(first);
  std::string_view line;
  while (all.find(']') == std::string::npos) {
    if (!lines.next(line)) bad_file(file, place, "the end of the file in a list", "a closing ]");
    all += ' ';
    all += line;
  }
  if (all.empty() || all[0] != '[') bad_file(file, place, in_quotes(all), "data: [ numbers ]");
  std::vector<double> out;
  std::string_view rest = std::string_view(all).substr(1, all.find(']') - 1);
  while (!trimmed(rest).empty()) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view item = trimmed(rest.substr(0, comma));
    const std::optional<double> value = number_of(item);
    if (!value) bad_file(file, place, in_quotes(item), "a number");
    out.push_back(*value);
    rest.remove_prefix(std::min(comma + 1, rest.size()));
  }
  return out;
}

YamlMatrix matrix(const std::string& file, const std::string& key, Lines& lines) {
  YamlMatrix out;
  out.file = file;
  out.place = "line " + std::to_string(lines.number) + ", " + key;
  std::string_view line, name, value;
  while (lines.next(line)) {
    if (!key_and_value(line, name, value)) bad_file(file, out.place, in_quotes(line), "rows, cols, dt, data");
    if (name == "rows" || name == "cols") {
      const double count = number_of(value).value_or(-1);
      if (!(count >= 1 && count <= 1000) || count != std::floor(count))
        bad_file(file, out.place + "." + std::string(name), in_quotes(value), "a whole number in 1..1000");
      (name == "rows" ? out.rows : out.cols) = static_cast<int>(count);
    } else if (name == "data") {
      out.data = numbers(file, out.place, value, lines);
      break;
    } else if (name != "dt") {
      bad_file(file, out.place, in_quotes(line), "rows, cols, dt, data");
    }
  }
  if (out.data.size() != static_cast<std::size_t>(out.rows) * static_cast<std::size_t>(out.cols) || out.data.empty())
    bad_file(
        file, out.place,
        std::to_string(out.data.size()) + " numbers for " + std::to_string(out.rows) + " x " + std::to_string(out.cols),
        "as many as rows x cols");
  return out;
}

}  // namespace

std::map<std::string, YamlMatrix> parse_opencv_yaml(const FileBytes& file) {
  std::map<std::string, YamlMatrix> out;
  Lines lines{file.view()};
  std::string_view line, key, value;
  bool first = true;
  while (lines.next(line)) {
    if (first && line.substr(0, 5) != "%YAML") bad_file(file.name, "line 1", in_quotes(line), "%YAML:1.0 of OpenCV");
    first = false;
    // Top-level keys stand at the line's begin; what is indented belongs to values that are not read.
    if (line.empty() || line[0] == ' ' || line[0] == '%' || line[0] == '#' || line.substr(0, 3) == "---" ||
        trimmed(line).empty())
      continue;
    if (!key_and_value(line, key, value)) {
      if (line[0] == '-' || line[0] == '.') continue;
      bad_file(file.name, "line " + std::to_string(lines.number), in_quotes(line), "key: value");
    }
    const std::string name(key);
    if (value == "!!opencv-matrix") {
      out[name] = matrix(file.name, name, lines);
    } else if (const std::optional<double> number = number_of(value)) {
      out[name] = {1, 1, {*number}, file.name, "line " + std::to_string(lines.number) + ", " + name};
    }
  }
  return out;
}

}  // namespace tribin::io
