#include "io/raw_cloud.hpp"
#include "io/text_cursor.hpp"

namespace tribin::io {
namespace {

bool separates(char c) { return TextCursor::is_space(c) || c == ',' || c == ';'; }

/// The numbers of a line, separated by spaces, commas or semicolons. \return how many, or -1 for what is no number.
int numbers_of(std::string_view line, double first[3]) {
  int count = 0;
  for (std::size_t at = 0; at < line.size();) {
    while (at < line.size() && separates(line[at])) ++at;
    const std::size_t from = at;
    while (at < line.size() && !separates(line[at])) ++at;
    if (from == at) break;
    const std::string_view word = line.substr(from + (line[from] == '+'), at - from - (line[from] == '+'));
    double value = 0;
    if (!whole_number(word, value)) return -1;
    if (count < 3) first[count] = value;
    ++count;
  }
  return count;
}

}  // namespace

RawCloud parse_xyz(const FileBytes& file) {
  RawCloud cloud{
      .name = file.name, .width = 0, .height = 1, .points = {}, .viewpoint = {}, .taken = {}, .warnings = {}};
  TextCursor cursor(file);
  std::string_view line;
  int columns = 0;
  bool first = true;
  for (std::size_t begin = 0; cursor.next_line(line); begin = cursor.position()) {
    if (line.find_first_not_of(" \t") == line.npos || line.starts_with('#') || line.starts_with("//")) continue;
    double p[3] = {0, 0, 0};
    const int count = numbers_of(line, p);
    const bool title = first && (count == -1 || count == 1);  // names of the columns, or PTS' number of points
    first = false;
    if (title && line.find('\0') == line.npos) continue;
    if (count < 3 || (columns && count != columns)) {
      bad_file(file.name, at_line(file.view(), begin), in_quotes(line),
               columns ? std::to_string(columns) + " numbers, as in the lines before" : "x y z");
    }
    columns = count;
    cloud.points.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
  }
  if (cloud.points.empty()) bad_file(file.name, "", "no points", "lines of x y z", ErrorCode::too_little_data);
  cloud.width = static_cast<int>(cloud.points.size());
  return cloud;
}

}  // namespace tribin::io
