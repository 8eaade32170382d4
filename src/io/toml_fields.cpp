#include "io/toml_fields.hpp"

#include <cstdio>

namespace tribin::io {

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

std::string range_text(const NumberRange& range) {
  return (range.least == kAboveZero ? "> 0" : number_text(range.least)) + " .. " + number_text(range.most);
}

std::string markdown_of(const std::vector<KeyRow>& rows) {
  std::string out = "| key | unit | range | default | meaning |\n|---|---|---|---|---|\n";
  for (const KeyRow& row : rows)
    out += "| `" + row.key + "` | " + row.unit + " | " + row.range + " | " +
           (row.fallback.empty() || row.fallback == "required" ? row.fallback : "`" + row.fallback + "`") + " | " +
           row.meaning + " |\n";
  return out;
}

}  // namespace tribin::io
