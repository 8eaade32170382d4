#include "tribin/report/figures.hpp"

#include <fstream>

#include "report/sections.hpp"
#include "report/sketch.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

/// Two key cylinders apart from each other and a plane: what figure 3 needs; coaxial ones when there is nothing else.
const Instance* shown_best(const Found& found) {
  const Instance* out = nullptr;
  for (const Instance& instance : found.instances.items) {
    if (instance.evidence.size() < 3 || instance.evidence[2].type != PrimitiveType::plane) continue;
    bool apart = false;
    for (const TestResult& test : instance.evidence[1].tests) apart |= test.test == "axis_offset" && test.passed;
    if (apart) return &instance;
    if (!out) out = &instance;
  }
  return out;
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error(ErrorCode::bad_option, path.string() + ": cannot be written");
}

}  // namespace

void write_paper_figures(const std::filesystem::path& dir, const Scan& scan, std::span<const Part> parts,
                         const Found& found) {
  const Instance* instance = shown_best(found);
  if (!instance)
    throw Error(ErrorCode::too_little_data,
                "the figures: no instance found by --method paper has two key cylinders and a plane in its evidence");
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  const int which = report::class_of(parts, instance->part);
  const Part& part = parts[static_cast<std::size_t>(which)];
  write(dir / "figure1.svg", report::figure_overview(scan, part, which, found, *instance));
  write(dir / "figure2.svg", report::figure_spaces(scan, part, found, *instance));
  write(dir / "figure3.svg", report::figure_geometry(scan, part, found, *instance));
}

}  // namespace tribin
