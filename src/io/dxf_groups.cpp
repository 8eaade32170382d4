#include <cmath>

#include "io/dxf.hpp"
#include "io/text_cursor.hpp"
#include "tribin/cad/polygon.hpp"

namespace tribin::io {
namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && TextCursor::is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && TextCursor::is_space(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

DxfGroups::DxfGroups(const FileBytes& file) : file_(file) {
  if (file.view().starts_with("AutoCAD Binary DXF")) {
    bad_file(file.name, "byte 0", "a binary DXF", "an ASCII DXF (save it as such)");
  }
  if (file.view().starts_with("\xef\xbb\xbf")) at_ = 3;  // the mark of UTF-8, which some writers put
  if (file.view().starts_with("AC10")) bad_file(file.name, "byte 0", "a DWG file", "a DXF (save it as such)");
}

DxfGroup DxfGroups::next() {
  const std::string_view text = file_.view();
  const auto line = [&](std::string_view& out) {
    if (at_ >= text.size()) return false;
    const std::size_t end = std::min(text.find('\n', at_), text.size());
    out = trimmed(text.substr(at_, end - at_));
    at_ = end + 1;
    return true;
  };
  for (;;) {
    DxfGroup group{0, {}, at_};
    std::string_view code;
    if (!line(code)) fail(group, "the end of the file", "0 / EOF");
    if (!whole_number(code, group.code)) fail(group, in_quotes(code), "a group code (a whole number)");
    if (!line(group.value)) fail(group, "the end of the file", "the value of group " + std::to_string(group.code));
    if (group.code != 999) return group;
  }
}

double DxfGroups::number(const DxfGroup& group) const {
  double value = 0;
  const std::string_view text = group.value.substr(group.value.starts_with('+'));
  if (!whole_number(text, value) || !std::isfinite(value) || std::abs(value) > 1e30) {
    fail(group, in_quotes(group.value), "a number as group " + std::to_string(group.code));
  }
  return value;
}

std::int64_t DxfGroups::whole(const DxfGroup& group) const {
  std::int64_t value = 0;
  if (!whole_number(group.value, value)) {
    fail(group, in_quotes(group.value), "a whole number as group " + std::to_string(group.code));
  }
  return value;
}

void DxfGroups::fail(const DxfGroup& group, std::string_view seen, std::string_view wanted) const {
  bad_file(file_.name, at_line(file_.view(), group.offset), seen, wanted);
}

void DxfFacets::add_polygon(const std::vector<Vec3>& corners) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  vertices.insert(vertices.end(), corners.begin(), corners.end());
  for (const auto& t : triangulate_polygon(corners)) triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

}  // namespace tribin::io
