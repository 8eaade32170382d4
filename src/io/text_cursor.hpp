#pragma once

#include <charconv>
#include <string_view>

#include "io/file_bytes.hpp"

namespace tribin::io {

/// Walks over a text of numbers and words; knows where it is, for messages.
class TextCursor {
 public:
  TextCursor(const FileBytes& file, std::size_t begin = 0) : file_(file), text_(file.view()), at_(begin) {}

  bool at_end() const { return at_ >= text_.size(); }
  std::size_t position() const { return at_; }
  std::string place() const { return at_line(text_, at_); }

  /// The next line without its end ("\n", "\r\n" or "\r"); false at the end of the file.
  bool next_line(std::string_view& line) {
    if (at_end()) return false;
    const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + (text_.substr(end, 2) == "\r\n" ? 2 : 1);
    if (at_ > text_.size()) at_ = text_.size();
    return true;
  }

  /// The next word, over line ends; empty at the end of the file.
  std::string_view next_word() {
    skip_spaces();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  /// The next number, over line ends ("nan" and "inf" count); throws bad_input where there is none.
  template <class T>
  T number(std::string_view wanted) {
    skip_spaces();
    const char* begin = text_.data() + at_;
    const char* end = text_.data() + text_.size();
    if (begin < end && *begin == '+') ++begin;
    T value{};
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error == std::errc{} && (stop == end || is_space(*stop))) {
      at_ = static_cast<std::size_t>(stop - text_.data());
      return value;
    }
    return rare_number<T>(wanted);
  }

  [[noreturn]] void fail(std::string_view wanted) {
    skip_spaces();
    const std::string where = place();
    const std::string_view word = next_word();
    bad_file(file_.name, where, word.empty() ? "the end of the file" : in_quotes(word), wanted);
  }

  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

 private:
  void skip_spaces() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }

  /// Numbers that std::from_chars leaves out: too small for the type (taken as 0) and too large.
  template <class T>
  T rare_number(std::string_view wanted) {
    if constexpr (std::is_floating_point_v<T>) {
      const std::size_t begin = at_;
      const std::string_view word = next_word();
      const char* first = word.data() + (!word.empty() && word[0] == '+');
      T value{};
      const auto [stop, error] = std::from_chars(first, word.data() + word.size(), value);
      const bool small = word.find("e-") != word.npos || word.find("E-") != word.npos;
      if (error == std::errc::result_out_of_range && stop == word.data() + word.size() && small) return T{0};
      at_ = begin;
    }
    fail(wanted);
  }

  const FileBytes& file_;
  std::string_view text_;
  std::size_t at_ = 0;
};

/// The words of one line.
std::vector<std::string_view> words_of(std::string_view line);

/// A whole number that fills the whole word; false where it is none.
template <class T>
bool whole_number(std::string_view word, T& value) {
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && stop == word.data() + word.size();
}

}  // namespace tribin::io
