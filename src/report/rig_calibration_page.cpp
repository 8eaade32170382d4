#include <cmath>
#include <fstream>
#include <sstream>

#include "report/html.hpp"
#include "report/sections.hpp"
#include "tribin/core/error.hpp"
#include "tribin/report/rig_calibration_json.hpp"

namespace tribin {
namespace {

using report::cell;
using report::escaped;
using report::number;

/// Points where they were seen, lines along their residuals, ninths with the sd of their rays.
std::string picture_of(const BoardObserver& seen, const ObserverCalibration& o) {
  const double w = seen.width, h = seen.height, px = w / 640;  // of the page
  // The residuals' rms is drawn a fiftieth of the width long.
  const double zoom = o.rms_px > 0 ? w / 50 / o.rms_px : 1;
  std::ostringstream svg;
  svg << "<svg viewBox=\"0 0 " << w << " " << h << "\" role=\"img\" aria-label=\"" << escaped(o.camera.name)
      << "\"><g stroke=\"var(--line)\" stroke-width=\"" << px << "\">";
  for (int k = 1; k < 3; ++k)
    svg << "<path d=\"M" << k * w / 3 << " 0V" << h << "M0 " << k * h / 3 << "H" << w << "\"/>";
  svg << "</g>";
  for (const bool used : {true, false}) {
    svg << "<g stroke=\"var(" << (used ? "--accent" : "--bad") << ")\" fill=\"var(" << (used ? "--accent" : "--bad")
        << ")\" stroke-width=\"" << 1.2 * px << "\">";
    for (const PointResidual& r : o.residuals) {
      if (r.used != used) continue;
      svg << "<circle cx=\"" << number(r.pixel.x(), 1) << "\" cy=\"" << number(r.pixel.y(), 1) << "\" r=\"" << 1.6 * px
          << "\"/>";
      // A wrong view's residuals would hide all others: they end at a tenth of the width.
      Vec2 line = zoom * r.off_px;
      if (!std::isfinite(line.x())) continue;
      if (line.norm() > w / 10) line *= w / 10 / line.norm();
      char path[120];
      std::snprintf(path, sizeof path, "<path d=\"M%.1f %.1fl%.1f %.1f\"/>", r.pixel.x(), r.pixel.y(), line.x(),
                    line.y());
      svg << path;
    }
    svg << "</g>";
  }
  svg << "<g font-size=\"" << 12 * px
      << "\" fill=\"var(--text-2)\" paint-order=\"stroke\" stroke=\"var(--surface)\" stroke-width=\"" << 4 * px
      << "\">";
  for (std::size_t k = 0; k < 9; ++k)
    svg << "<text x=\"" << static_cast<double>(k % 3) * w / 3 + 6 * px << "\" y=\""
        << static_cast<double>(k / 3) * h / 3 + 16 * px << "\">"
        << (o.coverage.points[k] == 0 ? "no board" : std::to_string(o.coverage.points[k]) + " points") << ", ray sd "
        << number(o.ray_sd_px[k], 2) << " px</text>";
  svg << "</g>";
  svg << "</svg>";
  return "<figure>" + svg.str() + "<figcaption>" + escaped(o.camera.name) + ": " + std::to_string(o.points) +
         " points, rms " + number(o.rms_px, 3) + " px; residuals " + number(zoom, 0) +
         " times as long; red is left out</figcaption></figure>\n";
}

std::string table_of_devices(const RigCalibrationReport& report) {
  std::string out = "<div class=\"box\"><table><tr><th>Device</th>";
  for (const char* name : kIntrinsicNames) out += std::string("<th class=\"num\">") + name + "</th>";
  out += "<th class=\"num\">place, mm</th></tr>\n";
  for (const ObserverCalibration& o : report.result.observers) {
    const RigCamera& c = o.camera;
    const double values[9] = {c.camera.fx,     c.camera.fy,     c.camera.cx,     c.camera.cy,    c.distortion[0],
                              c.distortion[1], c.distortion[2], c.distortion[3], c.distortion[4]};
    std::string value = "<tr><td>" + escaped(c.name) + "</td>", sd = "<tr><td class=\"u\">sd</td>";
    for (int i = 0; i < 9; ++i) {
      const double sigma = std::sqrt(o.covariance(i, i));
      value += cell(number(values[i], report::decimals_for(sigma) + 1));
      sd += cell(number(sigma, report::decimals_for(sigma) + 1) +
                 (o.held[static_cast<std::size_t>(i)] ? "" : " <span class=\"bad-text\">by the prior</span>"));
    }
    const Vec3 t = c.rig_from_camera.translation();
    out += value + cell(number(t.x(), 2) + ", " + number(t.y(), 2) + ", " + number(t.z(), 2)) + "</tr>\n" + sd +
           cell(number(std::sqrt(o.pose_covariance.topLeftCorner<3, 3>().trace()), 2)) + "</tr>\n";
  }
  return out + "</table></div>\n";
}

std::string table_of_views(const RigCalibrationReport& report) {
  std::string out = "<div class=\"box\"><table><tr><th>View</th>";
  for (const BoardObserver& o : report.observers)
    out += "<th class=\"num\">" + escaped(o.name) + report::unit("px") + "</th>";
  out += "<th></th></tr>\n";
  for (std::size_t v = 0; v < report.ids.size(); ++v) {
    const BoardView& view = report.result.views[v];
    bool seen = false;
    out += "<tr><td>" + escaped(report.ids[v]) + "</td>";
    for (const double rms : view.rms_px) {
      out += cell(number(rms, 3));
      seen |= std::isfinite(rms);
    }
    out += std::string("<td>") +
           (view.used ? ""
            : seen    ? "<span class=\"bad-text\">left out</span>"
                      : "board not found") +
           "</td></tr>\n";
  }
  return out + "</table></div>\n";
}

}  // namespace

void write_rig_calibration_report(const std::filesystem::path& folder, const RigCalibrationReport& report) {
  const std::vector<Warning> warnings = rig_calibration_warnings(report);
  std::string body = report::warning_lines(warnings, {});
  body += report::section("pictures", "Pictures", "Where the boards were seen, and how far off their points are.") +
          "<div class=\"two\">";
  for (std::size_t i = 0; i < report.observers.size(); ++i)
    body += picture_of(report.observers[i], report.result.observers[i]);
  body += "</div></section>\n" + report::section("devices", "Devices", "Values and standard deviations.") +
          table_of_devices(report) + "</section>\n" +
          report::section("views", "Views", "Root mean square of the residuals of each view.") +
          table_of_views(report) + "</section>\n";
  std::size_t used = 0;
  for (const BoardView& v : report.result.views) used += v.used;
  const std::string verdict = "rms " + number(report.result.rms_px, 3) + " px, " + std::to_string(used) + " of " +
                              std::to_string(report.ids.size()) + " views";
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  std::ofstream file(folder / "index.html", std::ios::binary);
  file << report::page("tribin: calibration", verdict, escaped(describe(report.board)),
                       warnings.empty() ? "ok" : "warn", "calibrated",
                       {{"pictures", "Pictures"}, {"devices", "Devices"}, {"views", "Views"}}, body);
  if (!file.flush())
    throw Error(ErrorCode::bad_option, folder.string() + ": saw a folder that cannot be written, wanted one that can");
}

}  // namespace tribin
