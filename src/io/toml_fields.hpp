#pragma once

#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/toml_place.hpp"

namespace tribin::io {

/// A line of the table of keys that people read.
struct KeyRow {
  std::string key, unit, range, fallback, meaning;
};

/// What a number may be, ends included.
struct NumberRange {
  double least = 0, most = 0;
};
/// The least number above 0.
inline constexpr double kAboveZero = std::numeric_limits<double>::min();

/// "0 .. 90", "> 0 .. 1000"
std::string range_text(const NumberRange& range);
/// Shortest text that reads back as the number, as far as 12 digits go.
std::string number_text(double value);

/// The keys of one TOML table and the members of T that they set: one list that checks a file and describes itself.
/// Defaults are those of T{}.
template <class T>
class Fields {
 public:
  /// A number; `scale` turns the file's unit into ours.
  Fields& number(const char* key, const char* unit, NumberRange range, double T::*member, const char* meaning,
                 double scale = 1) {
    const std::string wanted = "a number in " + range_text(range);
    return add({key, unit, range_text(range), number_text(T{}.*member / scale), meaning},
               [=](const TomlPlace& p, T& out) { out.*member = p.number(range.least, range.most, wanted) * scale; });
  }

  Fields& whole(const char* key, int least, int most, int T::*member, const char* meaning) {
    const std::string range = range_text({double(least), double(most)}), wanted = "a whole number in " + range;
    return add({key, "", range, std::to_string(T{}.*member), meaning},
               [=](const TomlPlace& p, T& out) { out.*member = p.whole(least, most, wanted); });
  }

  Fields& flag(const char* key, bool T::*member, const char* meaning) {
    return add({key, "", "true, false", T{}.*member ? "true" : "false", meaning},
               [=](const TomlPlace& p, T& out) { out.*member = p.flag(); });
  }

  Fields& text(const char* key, std::string T::*member, const char* meaning) {
    return add({key, "", "text", (T{}.*member).empty() ? "" : "\"" + T{}.*member + "\"", meaning},
               [=](const TomlPlace& p, T& out) { out.*member = p.text("a text in quotes"); });
  }

  /// A file, sought beside the one that names it.
  Fields& file(const char* key, std::filesystem::path T::*member, const char* meaning) {
    return add({key, "", "file", "", meaning}, [=](const TomlPlace& p, T& out) {
      const std::string name = p.text("the name of a file, in quotes");
      if (name.empty()) p.fail("the name of a file");
      out.*member = std::filesystem::path(p.file()).parent_path() / name;
    });
  }

  template <class Enum>
  Fields& choice(const char* key, std::vector<std::pair<const char*, Enum>> names, Enum T::*member,
                 const char* meaning) {
    std::string range, fallback;
    for (const auto& [name, value] : names) {
      range += (range.empty() ? "" : ", ") + std::string(name);
      if (value == T{}.*member) fallback = "\"" + std::string(name) + "\"";
    }
    return add({key, "", range, fallback, meaning}, [=](const TomlPlace& p, T& out) {
      const std::string name = p.text("one of " + range);
      for (const auto& [known, value] : names)
        if (name == known) {
          out.*member = value;
          return;
        }
      p.fail("one of " + range);
    });
  }

  /// A list of as many numbers as the member has (Vec3, std::array).
  template <class Numbers>
  Fields& numbers(const char* key, const char* unit, NumberRange range, Numbers T::*member, const char* meaning) {
    std::string fallback;
    const T fresh{};
    const auto count = static_cast<std::size_t>((fresh.*member).size());
    for (std::size_t i = 0; i < count; ++i) fallback += (i ? ", " : "[") + number_text((fresh.*member)[i]);
    const std::string wanted = std::to_string(count) + " numbers in " + range_text(range);
    return add({key, unit, range_text(range), fallback + "]", meaning}, [=](const TomlPlace& p, T& out) {
      if (p.array_size(wanted) != count) p.fail(wanted);
      for (std::size_t i = 0; i < count; ++i)
        (out.*member)[i] = p.at(i).number(range.least, range.most, "one of " + wanted);
    });
  }

  Fields& texts(const char* key, std::vector<std::string> T::*member, const char* meaning) {
    return add({key, "", "list of texts", "[]", meaning}, [=](const TomlPlace& p, T& out) {
      constexpr const char* kWanted = "a list of texts in quotes";
      for (std::size_t i = 0, n = p.array_size(kWanted); i < n; ++i)
        (out.*member).push_back(p.at(i).text("a text in quotes"));
    });
  }

  /// A value with a reader of its own: `read(place)` gives it.
  template <class Value, class Read>
  Fields& value(const char* key, const char* unit, const char* range, const char* fallback, Value T::*member,
                const char* meaning, Read read) {
    return add({key, unit, range, fallback, meaning}, [=](const TomlPlace& p, T& out) { out.*member = read(p); });
  }

  /// A table below this one.
  template <class Sub, class Member>
  Fields& table(const char* key, const Fields<Sub>& fields, Member T::*member, const char* meaning) {
    add({key, "", "table", "", meaning}, [=](const TomlPlace& p, T& out) { out.*member = fields.read(p); });
    list_.back().inner = fields.rows(std::string(key) + ".");
    return *this;
  }

  /// A list of tables.
  template <class Sub>
  Fields& list(const char* key, const Fields<Sub>& fields, std::vector<Sub> T::*member, const char* meaning) {
    add({key, "", "list of tables", "[]", meaning}, [=](const TomlPlace& p, T& out) {
      constexpr const char* kWanted = "a list of tables";
      for (std::size_t i = 0, n = p.array_size(kWanted); i < n; ++i) (out.*member).push_back(fields.read(p.at(i)));
    });
    list_.back().inner = fields.rows(std::string(key) + "[].");
    return *this;
  }

  /// The key that was added last has no default: it must be there.
  Fields& required() {
    list_.back().required = true;
    list_.back().row.fallback = "required";
    return *this;
  }

  /// What the whole table must hold beyond its keys; it throws by the place's `fail`.
  Fields& check(std::function<void(const TomlPlace&, const T&)> check) {
    checks_.push_back(std::move(check));
    return *this;
  }

  T read(const TomlPlace& place) const {
    for (const auto& [key, node] : place.table()) {
      std::string known;
      bool found = false;
      for (const Field& field : list_) {
        found = found || key.str() == field.row.key;
        known += (known.empty() ? "" : ", ") + field.row.key;
      }
      if (!found) place.fail_at_key(key, "one of " + known);
    }
    T out{};
    for (const Field& field : list_) {
      if (place.has(field.row.key))
        field.read(place.at(field.row.key), out);
      else if (field.required)
        place.fail_missing(field.row.key);
    }
    for (const auto& check : checks_) check(place, out);
    return out;
  }

  /// All keys, those of tables below behind their table's.
  std::vector<KeyRow> rows(const std::string& prefix = {}) const {
    std::vector<KeyRow> out;
    for (const Field& field : list_) {
      out.push_back(field.row);
      out.insert(out.end(), field.inner.begin(), field.inner.end());
    }
    for (KeyRow& row : out) row.key = prefix + row.key;
    return out;
  }

 private:
  struct Field {
    KeyRow row;
    std::function<void(const TomlPlace&, T&)> read;
    std::vector<KeyRow> inner;
    bool required = false;
  };

  Fields& add(KeyRow row, std::function<void(const TomlPlace&, T&)> read) {
    list_.push_back({std::move(row), std::move(read), {}, false});
    return *this;
  }

  std::vector<Field> list_;
  std::vector<std::function<void(const TomlPlace&, const T&)>> checks_;
};

/// The rows as a Markdown table.
std::string markdown_of(const std::vector<KeyRow>& rows);

}  // namespace tribin::io
