#include "io/toml_place.hpp"

#include <cmath>
#include <sstream>

namespace tribin::io {
namespace {

std::string at_source(const toml::source_region& source) {
  return "line " + std::to_string(source.begin.line) + ", column " + std::to_string(source.begin.column);
}

std::string seen(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return node.as_array()->empty() ? "an empty list" : "a list";
  if (node.is_string()) return in_quotes(**node.as_string());
  std::ostringstream text;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_value<decltype(value)>) text << *value;
  });
  return node.is_boolean() ? (**node.as_boolean() ? "true" : "false") : text.str();
}

}  // namespace

std::string TomlPlace::where() const { return at_source(node_.source()) + (place_.empty() ? "" : ": " + place_); }

void TomlPlace::fail(std::string_view wanted, ErrorCode code) const {
  bad_file(file_, where(), seen(node_), wanted, code);
}

void TomlPlace::fail_at_key(const toml::key& key, std::string_view wanted) const {
  bad_file(file_, at_source(key.source()) + (place_.empty() ? "" : ": " + place_), "the key " + in_quotes(key.str()),
           wanted);
}

void TomlPlace::fail_missing(std::string_view key) const {
  bad_file(file_, place_.empty() ? "top level" : where(), "no " + std::string(key), "it to be there");
}

bool TomlPlace::has(std::string_view key) const { return table().contains(key); }

TomlPlace TomlPlace::at(std::string_view key) const {
  const toml::node* found = table().get(key);
  if (!found) fail_missing(key);
  return {file_, *found, place_.empty() ? std::string(key) : place_ + "." + std::string(key)};
}

TomlPlace TomlPlace::at(std::size_t index) const {
  return {file_, *node_.as_array()->get(index), place_ + "[" + std::to_string(index) + "]"};
}

const toml::table& TomlPlace::table() const {
  if (!node_.is_table()) fail("a table {..}");
  return *node_.as_table();
}

std::size_t TomlPlace::array_size(std::string_view wanted) const {
  if (!node_.is_array()) fail(wanted);
  return node_.as_array()->size();
}

double TomlPlace::number(double least, double most, std::string_view wanted) const {
  if (!node_.is_number()) fail(wanted);
  const double value = *node_.value<double>();
  if (!(value >= least && value <= most)) fail(wanted);  // NaN fails too
  return value;
}

int TomlPlace::whole(int least, int most, std::string_view wanted) const {
  if (!node_.is_integer()) fail(wanted);
  return static_cast<int>(number(least, most, wanted));
}

bool TomlPlace::flag() const {
  if (!node_.is_boolean()) fail("true or false");
  return **node_.as_boolean();
}

std::string TomlPlace::text(std::string_view wanted) const {
  if (!node_.is_string()) fail(wanted);
  return **node_.as_string();
}

toml::table parse_toml(const FileBytes& file) {
  try {
    return toml::parse(file.view(), file.name);
  } catch (const toml::parse_error& error) {
    bad_file(file.name, at_source(error.source()), "text that is no TOML (" + std::string(error.description()) + ")",
             "a TOML file");
  }
}

}  // namespace tribin::io
