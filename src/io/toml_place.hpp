#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "io/file_bytes.hpp"

namespace tribin::io {

/// Walks into a TOML document and knows where it is, so that each complaint is one sentence:
/// "cell.toml: line 12, column 5: gripper[0].force_n: saw "-3", wanted a number in 0 .. 100000".
class TomlPlace {
 public:
  TomlPlace(const std::string& file, const toml::node& node, std::string place)
      : file_(file), node_(node), place_(std::move(place)) {}

  const std::string& file() const { return file_; }
  const toml::node& node() const { return node_; }
  [[noreturn]] void fail(std::string_view wanted, ErrorCode code = ErrorCode::bad_input) const;
  /// The same about a key: where it stands, and what was seen there.
  [[noreturn]] void fail_at_key(const toml::key& key, std::string_view wanted) const;
  [[noreturn]] void fail_missing(std::string_view key) const;

  bool has(std::string_view key) const;
  TomlPlace at(std::string_view key) const;
  TomlPlace at(std::size_t index) const;

  const toml::table& table() const;
  std::size_t array_size(std::string_view wanted) const;
  double number(double least, double most, std::string_view wanted) const;
  int whole(int least, int most, std::string_view wanted) const;
  bool flag() const;
  std::string text(std::string_view wanted) const;

 private:
  std::string where() const;

  const std::string& file_;
  const toml::node& node_;
  std::string place_;
};

/// \throws Error bad_input with line and column where the text is no TOML.
toml::table parse_toml(const FileBytes& file);

}  // namespace tribin::io
