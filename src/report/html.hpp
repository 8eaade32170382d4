#pragma once

#include <string>
#include <vector>

#include "report/png.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin::report {

std::string escaped(const std::string& text);
/// With a real minus sign; "–" for not a number.
std::string number(double value, int decimals);
/// Thin spaces between thousands.
std::string grouped(long long value);
/// Decimals so that the last one stands where the sigma's first digit is.
int decimals_for(double sigma);
/// `<td class="num">`
std::string cell(const std::string& content);
std::string unit(const std::string& name);

std::string type_icon(PrimitiveType type);
/// The class's letter in a square: A, B, ...
std::string class_tag(int part_class);
/// ok | warn | bad: a shape, so that colour does not speak alone.
std::string state_icon(const std::string& state);

/// A picture for light and dark pages, inline: the same pixels under two palettes.
std::string picture(const Image<std::uint8_t>& indices, const std::vector<Rgb>& light, const std::vector<Rgb>& dark,
                    const std::string& alt);

/// A dot on a rail of +-3 sigma.
std::string sigma_rail(double in_sigmas);

/// `<section id=..><h2>..</h2><p>..</p>`; the caller closes it.
std::string section(const std::string& id, const std::string& title, const std::string& lead);

struct TocEntry {
  std::string id, title;
};
/// The page around a body: tokens, style, head line, contents.
/// \param state  ok | warn | bad, of the chip; chip = its words.
std::string page(const std::string& title, const std::string& verdict, const std::string& lead,
                 const std::string& state, const std::string& chip, const std::vector<TocEntry>& contents,
                 const std::string& body);

/// SHA-256 of a file, as hex.
/// \throws Error bad_input when it cannot be read.
std::string sha256_of_file(const std::string& path);

}  // namespace tribin::report
