#include "report/html.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tribin::report {

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  return out;
}

std::string number(double value, int decimals) {
  if (!std::isfinite(value)) return "–";
  char out[64];
  std::snprintf(out, sizeof out, "%.*f", std::clamp(decimals, 0, 9), value);
  std::string text = out;
  if (text[0] == '-')
    text = text.find_first_of("123456789") == std::string::npos ? text.substr(1) : "−" + text.substr(1);
  return text;
}

std::string grouped(long long value) {
  std::string digits = std::to_string(value < 0 ? -value : value), out;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += "\u2009";
    out += digits[i];
  }
  return value < 0 ? "−" + out : out;
}

int decimals_for(double sigma) {
  if (!(sigma > 0) || !std::isfinite(sigma)) return 3;
  return std::clamp(static_cast<int>(std::ceil(-std::log10(sigma))), 0, 4);
}

std::string cell(const std::string& content) { return "<td class=\"num\">" + content + "</td>"; }
std::string unit(const std::string& name) { return " <span class=\"u\">" + name + "</span>"; }

std::string type_icon(PrimitiveType type) {
  static const char* const kNames[] = {"plane", "cylinder", "cone", "sphere", "torus"};
  static const char* const kPaths[] = {
      "<path d=\"M2 11.5 6 4.5h8l-4 7z\"/>",
      "<path d=\"M4 4v8c0 1 2 2 4 2s4-1 4-2V4\"/><ellipse cx=\"8\" cy=\"4\" rx=\"4\" ry=\"1.8\"/>",
      "<path d=\"M8 2 3.5 12c0 1 2 2 4.5 2s4.5-1 4.5-2z\"/>",
      "<circle cx=\"8\" cy=\"8\" r=\"5.6\"/><path d=\"M2.5 8.500c2 2 9 2 11 0\"/>",
      "<ellipse cx=\"8\" cy=\"8\" rx=\"6.2\" ry=\"4.4\"/><ellipse cx=\"8\" cy=\"7.6\" rx=\"2.6\" ry=\"1.3\"/>"};
  const int i = static_cast<int>(type);
  const std::string name = kNames[i];
  return "<svg class=\"ty " + name + "\" viewBox=\"0 0 16 16\" role=\"img\" aria-label=\"" + name + "\">" + kPaths[i] +
         "</svg>";
}

std::string class_tag(int part_class) {
  const char lower = static_cast<char>('a' + part_class % 6), letter = static_cast<char>('A' + part_class % 26);
  return std::string("<span class=\"cls c") + lower + "\">" + letter + "</span>";
}

std::string state_icon(const std::string& state) {
  const std::string path = state == "ok"
                               ? "<circle cx=\"6\" cy=\"6\" r=\"5\"/><path d=\"m3.700 6.200 1.600 1.600 3-3.300\"/>"
                           : state == "warn" ? "<path d=\"M6 1.500 11 10.500H1z\"/><path d=\"M6 5v2.500M6 8.600v.6\"/>"
                                             : "<path d=\"M4 1h4l3 3v4l-3 3H4L1 8V4z\"/><path d=\"m4 4 4 4m0-4-4 4\"/>";
  return "<svg class=\"state\" viewBox=\"0 0 12 12\" aria-hidden=\"true\">" + path + "</svg>";
}

std::string picture(const Image<std::uint8_t>& indices, const std::vector<Rgb>& light, const std::vector<Rgb>& dark,
                    const std::string& alt) {
  return "<picture><source media=\"screen and (prefers-color-scheme: dark)\" srcset=\"data:image/png;base64," +
         base64(png_of(indices, dark)) + "\"><img alt=\"" + escaped(alt) + "\" width=\"" +
         std::to_string(indices.width) + "\" height=\"" + std::to_string(indices.height) +
         "\" src=\"data:image/png;base64," + base64(png_of(indices, light)) + "\"></picture>";
}

std::string sigma_rail(double in_sigmas) {
  const double x = 50 + std::clamp(in_sigmas, -4.6, 4.6) * 10;
  const std::string at = number(x, 1), label = number(in_sigmas, 1) + " sigma";
  const bool beyond = std::abs(in_sigmas) > 3;
  return "<svg class=\"rail" + std::string(beyond ? " bad" : "") +
         "\" viewBox=\"0 0 100 14\" role=\"img\" aria-label=\"" + label + "\"><title>" + label +
         "</title><rect x=\"20\" y=\"4\" width=\"60\" height=\"6\" rx=\"2\"/>" +
         "<path class=\"ticks\" d=\"M50 1v12M20 3v8M80 3v8\"/><path class=\"bar\" d=\"M50 7H" + at +
         "\"/><circle cx=\"" + at + "\" cy=\"7\" r=\"3.6\"/></svg>";
}

std::string section(const std::string& id, const std::string& title, const std::string& lead) {
  return "<section id=\"" + id + "\"><h2>" + title + "</h2>" + (lead.empty() ? "" : "<p>" + lead + "</p>");
}

}  // namespace tribin::report
