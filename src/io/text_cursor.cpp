#include "io/text_cursor.hpp"

namespace tribin::io {

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while (at < line.size()) {
    while (at < line.size() && TextCursor::is_space(line[at])) ++at;
    const std::size_t begin = at;
    while (at < line.size() && !TextCursor::is_space(line[at])) ++at;
    if (at > begin) words.push_back(line.substr(begin, at - begin));
  }
  return words;
}

}  // namespace tribin::io
