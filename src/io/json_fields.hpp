#pragma once

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "io/file_bytes.hpp"

namespace tribin::io {

/// Walks into a JSON document and knows where it is, so that each complaint is one sentence:
/// "poses.json: robot[3].pose: saw "[1,2]", wanted 6 numbers".
class JsonPlace {
 public:
  using Json = nlohmann::json;

  JsonPlace(const std::string& file, const Json& value, std::string place)
      : file_(file), value_(value), place_(std::move(place)) {}

  const Json& value() const { return value_; }
  const std::string& place() const { return place_; }
  [[noreturn]] void fail(std::string_view wanted, ErrorCode code = ErrorCode::bad_input) const {
    bad_file(file_, place_, value_.is_object() ? "an object" : in_quotes(value_.dump()), wanted, code);
  }

  bool has(const char* key) const { return value_.contains(key); }

  /// The value below a key; `wanted` says what is missing where there is none.
  JsonPlace at(const char* key, std::string_view wanted) const {
    if (!value_.contains(key)) bad_file(file_, place_, "no \"" + std::string(key) + "\"", wanted);
    return {file_, value_.at(key), place_ == kTop ? key : place_ + "." + key};
  }

  JsonPlace at(std::size_t index) const {
    return {file_, value_.at(index), place_ + "[" + std::to_string(index) + "]"};
  }

  void must_be_object(std::string_view wanted) const {
    if (!value_.is_object()) fail(wanted);
  }

  std::size_t array_size(std::string_view wanted) const {
    if (!value_.is_array()) fail(wanted);
    return value_.size();
  }

  /// A misspelt key would be a setting without effect.
  void only_keys(std::initializer_list<std::string_view> known) const {
    for (const auto& [key, ignored] : value_.items()) {
      bool found = false;
      std::string list;
      for (std::string_view k : known) {
        found = found || k == key;
        list += (list.empty() ? "" : ", ") + std::string(k);
      }
      if (!found) bad_file(file_, place_, "the key " + in_quotes(key), "one of " + list);
    }
  }

  std::vector<double> numbers(std::size_t count, std::string_view wanted) const {
    return numbers(count, count, wanted);
  }
  std::vector<double> numbers(std::size_t least, std::size_t most, std::string_view wanted) const {
    if (!value_.is_array() || value_.size() < least || value_.size() > most) fail(wanted);
    std::vector<double> out;
    for (const Json& number : value_) {
      if (!number.is_number() || !std::isfinite(number.get<double>())) fail(wanted);
      out.push_back(number.get<double>());
    }
    return out;
  }

  /// A number in [least, most].
  double number(double least, double most, std::string_view wanted) const {
    if (!value_.is_number() || !(value_.get<double>() >= least && value_.get<double>() <= most)) fail(wanted);
    return value_.get<double>();
  }

  int whole(int least, int most, std::string_view wanted) const {
    if (!value_.is_number_integer()) fail(wanted);
    return static_cast<int>(number(least, most, wanted));
  }

  std::string text(std::string_view wanted) const {
    if (!value_.is_string()) fail(wanted);
    return value_.get<std::string>();
  }

  static constexpr const char* kTop = "top level";

 private:
  const std::string& file_;
  const Json& value_;
  std::string place_;
};

/// \throws Error bad_input with the line where the text is no JSON.
inline nlohmann::json parse_json(const FileBytes& file, std::string_view wanted) {
  try {
    return nlohmann::json::parse(file.data);
  } catch (const nlohmann::json::parse_error& error) {
    bad_file(file.name, at_line(file.view(), error.byte), "text that is no JSON", wanted);
  }
}

}  // namespace tribin::io
