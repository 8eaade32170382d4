#include "report/html.hpp"
#include "report/sections.hpp"

namespace tribin::report {
namespace {

std::string place_cells(const Vec3& at) {
  std::string out;
  for (int k = 0; k < 3; ++k) out += cell(number(at[k], 1));
  return out;
}

std::string bin_line(const BinSighting& bin, const Pose& input_from_camera) {
  if (!bin.found)
    return "<p>" + state_icon("warn") + "The bin is not found, and nothing of it is taken out: " + escaped(bin.reason) +
           ".</p>";
  const Vec3 at = input_from_camera * Vec3(bin.camera_from_bin.translation());
  std::string out = "<p>The bin's floor has its middle at " + number(at.x(), 2) + ", " + number(at.y(), 2) + ", " +
                    number(at.z(), 2) + " mm; it is " + number(100 * bin.fill, 0) + " % full.";
  if (bin.drift_sigma)
    out += " That is " + number(bin.drift_mm, 2) + " mm and " + number(bin.drift_rad / kDegree, 2) +
           "° from where it is said to stand, " + number(*bin.drift_sigma, 1) + " sigmas of what is known; beyond " +
           number(kDriftLimit, 1) + " it was moved, or the calibration has drifted.";
  return out + "</p>";
}

}  // namespace

std::string bin_section(const Scan& scan, const Found& found) {
  if (!found.bin && found.instances.unexplained.empty()) return {};
  std::string out = section("bin", found.bin ? "Bin and the rest" : "The rest",
                            "What neither a part nor the bin (or, without one, a surface larger than the parts) "
                            "explains, and is large enough to be a piece of a part.");
  if (found.bin) out += bin_line(*found.bin, scan.input_from_camera);
  if (found.instances.unexplained.empty()) return out + "<p>Nothing is left unexplained.</p></section>\n";
  out += "<div class=\"box\"><table><thead><tr>";
  for (const char* name : {"x", "y", "z"}) out += "<th class=\"num\">" + (name + unit("mm")) + "</th>";
  out += "<th class=\"num\">Volume" + unit("cm³") + "</th><th class=\"num\">Pixels</th></tr></thead><tbody>";
  for (const UnexplainedRegion& region : found.instances.unexplained)
    out += "<tr>" + place_cells(scan.input_from_camera * region.center_mm) + cell(number(region.volume_mm3 / 1000, 1)) +
           cell(grouped(region.pixels)) + "</tr>";
  return out + "</tbody></table></div></section>\n";
}

}  // namespace tribin::report
