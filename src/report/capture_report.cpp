#include "tribin/report/capture_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>

#include "report/html.hpp"
#include "report/palette.hpp"
#include "report/png.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using report::Rgb;

constexpr int kWidth = 640;  // of a picture on the page

/// One colour for each reason; index 0 of a palette is transparent, so that reasons begin at 1.
constexpr std::array<Rgb, kInvalidReasons> kReasonColours = {{{220, 220, 220},
                                                              {0, 0, 0},
                                                              {40, 40, 60},
                                                              {60, 60, 60},
                                                              {120, 90, 40},
                                                              {255, 255, 90},
                                                              {170, 60, 170},
                                                              {230, 60, 60},
                                                              {255, 140, 0},
                                                              {70, 110, 220},
                                                              {20, 20, 20}}};

/// A picture of an image's every n-th pixel; `index` gives 0 for nothing.
std::string picture(int width, int height, const std::vector<Rgb>& palette, const std::string& caption,
                    const std::function<int(int, int)>& index) {
  const int step = std::max(1, (width + kWidth - 1) / kWidth);
  Image<std::uint8_t> out(width / step, height / step);
  for (int v = 0; v < out.height; ++v)
    for (int u = 0; u < out.width; ++u) out(u, v) = static_cast<std::uint8_t>(index(u * step, v * step));
  return "<figure><img alt=\"" + caption + "\" src=\"data:image/png;base64," +
         report::base64(report::png_of(out, palette)) + "\"><figcaption>" + caption + "</figcaption></figure>\n";
}

std::vector<Rgb> ramp(Rgb (*colour)(double)) {
  std::vector<Rgb> out{{0, 0, 0}};
  for (int i = 0; i < 255; ++i) out.push_back(colour(i / 254.0));
  return out;
}

std::string picture_of(const Image<float>& values, const std::string& what, const char* unit) {
  std::vector<float> finite;
  for (const float v : values.data)
    if (std::isfinite(v)) finite.push_back(v);
  if (finite.empty()) return "<p>" + what + ": nothing measured</p>\n";
  std::sort(finite.begin(), finite.end());
  // A hundredth at either end may be wild: the ramp is for the others.
  const float low = finite[finite.size() / 100],
              high = std::max(finite[finite.size() - 1 - finite.size() / 100], low + 1e-6f);
  char range[96];
  std::snprintf(range, sizeof range, ", dark %.1f to bright %.1f %s", low, high, unit);
  return picture(values.width, values.height, ramp(report::viridis), what + range, [&](int u, int v) {
    const float value = values(u, v);
    return std::isfinite(value) ? 1 + static_cast<int>(254 * std::clamp((value - low) / (high - low), 0.0f, 1.0f)) : 0;
  });
}

std::string picture_of_validity(const Image<std::uint8_t>& reasons, const std::string& what) {
  std::vector<Rgb> palette{{0, 0, 0}};
  palette.insert(palette.end(), kReasonColours.begin(), kReasonColours.end());
  std::string legend = "<p>";
  for (int r = 0; r < kInvalidReasons; ++r) {
    const auto count = std::count(reasons.data.begin(), reasons.data.end(), static_cast<std::uint8_t>(r));
    if (count == 0) continue;
    char share[32];
    std::snprintf(share, sizeof share, " %.2f %%",
                  100.0 * static_cast<double>(count) / static_cast<double>(reasons.size()));
    legend += "<span style=\"background:" + report::hex(kReasonColours[static_cast<std::size_t>(r)]) +
              "\">&nbsp;&nbsp;&nbsp;</span> " + std::string(name_of(static_cast<Invalid>(r))) + share + " &nbsp; ";
  }
  return picture(reasons.width, reasons.height, palette, what,
                 [&](int u, int v) { return 1 + std::min<int>(reasons(u, v), kInvalidReasons - 1); }) +
         legend + "</p>\n";
}

}  // namespace

std::string describe_validity(const Image<std::uint8_t>& reasons) {
  std::string out;
  for (int r = 0; r < kInvalidReasons; ++r) {
    const auto count = std::count(reasons.data.begin(), reasons.data.end(), static_cast<std::uint8_t>(r));
    if (count == 0) continue;
    char share[64];
    std::snprintf(share, sizeof share, "%s%s %.1f %%", out.empty() ? "" : ", ",
                  std::string(name_of(static_cast<Invalid>(r))).c_str(),
                  100.0 * static_cast<double>(count) / static_cast<double>(reasons.size()));
    out += share;
  }
  return out;
}

void write_capture_report(const std::filesystem::path& folder, const Triangulated& result,
                          std::span<const Decoded> cameras) {
  std::string page =
      "<!doctype html><meta charset=\"utf-8\"><title>tribin scan</title><style>body{font:15px sans-serif;margin:2em;"
      "max-width:1340px}figure{display:inline-block;margin:0 8px 8px 0}img{background:#888;max-width:100%}</style>\n"
      "<h1>Scan</h1>\n";
  const Scan& scan = result.scan;
  char line[240];
  std::snprintf(line, sizeof line,
                "<p>%d x %d, %zu points, noise %.3f mm; epipolar lines off by %.2f px (+- %.2f, %d places).</p>\n",
                scan.width(), scan.height(), valid_count(scan), scan.noise.sigma_mm, result.epipolar.median_px,
                result.epipolar.spread_px, result.epipolar.places);
  page += line;
  for (const std::string& warning : scan.warnings) page += "<p><b>Warning:</b> " + warning + "</p>\n";
  page += picture_of(scan.z_mm, "Depth", "mm");
  page += picture_of_validity(scan.invalid_reason, "Validity of the scan");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Decoded& d = cameras[i];
    page += "<h2>Camera " + std::to_string(i + 1) + "</h2>\n";
    std::snprintf(line, sizeof line, "<p>Image noise %.2f grey levels.</p>\n", d.image_noise);
    page += line;
    page += picture_of(d.column, "Projector column (phase)", "px");
    if (!d.row.empty()) page += picture_of(d.row, "Projector row (phase)", "px");
    page += picture(d.width(), d.height(), ramp(report::magma), "Modulation, dark 0 to bright 255 grey levels",
                    [&](int u, int v) { return 1 + std::min<int>(d.modulation(u, v), 254); });
    page += picture_of_validity(d.invalid_reason, "Validity of the decoding");
  }
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  std::ofstream file(folder / "index.html", std::ios::binary);
  file << page;
  file.close();
  if (!file) throw Error(ErrorCode::bad_option, (folder / "index.html").string() + ": cannot be written");
}

}  // namespace tribin
