#pragma once

#include <string>
#include <vector>

/// What every HTML page of tribin is made of: the tokens and the style of the report, for pages of other stages.
namespace tribin::report {

std::string escaped(const std::string& text);
/// With a real minus sign; "–" for not a number.
std::string number(double value, int decimals);
/// Thin spaces between thousands.
std::string grouped(long long value);
/// `<td class="num">`
std::string cell(const std::string& content);
std::string unit(const std::string& name);
/// The class's letter in a square: A, B, ...
std::string class_tag(int part_class);
/// ok | warn | bad: a shape, so that colour does not speak alone.
std::string state_icon(const std::string& state);
/// `<section id=..><h2>..</h2><p>..</p>`; the caller closes it.
std::string section(const std::string& id, const std::string& title, const std::string& lead);
std::string base64(const std::string& bytes);

struct TocEntry {
  std::string id, title;
};
/// The page around a body: tokens, style, head line, contents.
/// \param state  ok | warn | bad, of the chip; chip = its words.
std::string page(const std::string& title, const std::string& verdict, const std::string& lead,
                 const std::string& state, const std::string& chip, const std::vector<TocEntry>& contents,
                 const std::string& body);

}  // namespace tribin::report
