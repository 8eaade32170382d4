// Real heaps of pipe elbows and couplers (RealSense): which of those that people see whole are found, how the CAD lies
// on their own points, and what is given out that nobody saw. Wanted: 90 % of the whole ones, 2 mm rms over 60 % of an
// instance's own points, nothing off the list without a picture: a page for each scan is written to
// build/campaign/elbows. usage: campaign_elbows [SIGMA_MM [CORRELATION_PX]]

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/shared_data.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/scan_files.hpp"
#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"
#include "tribin/report/report.hpp"

namespace {

using namespace tribin;

struct Seen {
  std::string name;
  bool whole = false;
  Vec3 at = Vec3::Zero();  ///< camera frame
  bool found = false;
};

struct Overlay {
  double rms_mm = 0;          ///< of the nearest 60 % of its own points
  double measured_share = 0;  ///< of the silhouette
};

/// The instance's own points: what is measured in its silhouette and is not in front of it by more than a tube's wall.
Overlay overlay_of(const Part& part, const Scan& scan, const Instance& instance) {
  constexpr double kInFront = 5, kShare = 0.6;
  IndexRender render;
  render_index(part.render_mesh, scan.camera, instance.camera_from_part, 1, render);
  std::vector<double> off;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t t = render.triangle[render.index(i, j)];
      const int u = render.u0 + i, v = render.v0 + j;
      if (t < 0 || !scan.z_mm.contains(u, v) || !(scan.z_mm(u, v) > 0)) continue;
      const double z = 1 / render.inverse_z[render.index(i, j)];
      if (scan.z_mm(u, v) < z - kInFront) continue;
      off.push_back((scan.z_mm(u, v) - z) *
                    render.normal[static_cast<std::size_t>(t)].cast<double>().dot(scan.camera.ray(u, v)));
    }
  Overlay out;
  if (off.empty()) return out;
  std::sort(off.begin(), off.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  const auto count = static_cast<std::size_t>(std::ceil(kShare * static_cast<double>(off.size())));
  for (std::size_t k = 0; k < count; ++k) out.rms_mm += off[k] * off[k];
  out.rms_mm = std::sqrt(out.rms_mm / static_cast<double>(count));
  out.measured_share = double(off.size()) / double(render.silhouette_pixels);
  return out;
}

/// Median of the local noise of z [mm].
double used_sigma(const Surfels& surfels) {
  std::vector<float> tiles = surfels.local_sigma_mm.data;
  std::erase_if(tiles, [](float s) { return !(s > 0); });
  std::sort(tiles.begin(), tiles.end());
  return tiles.empty() ? 0 : tiles[tiles.size() / 2];
}

/// How far a point lies from the part's surface [mm]: to the nearest vertex or middle of a facet.
double distance_to(const Part& part, const Instance& instance, const Vec3& at) {
  const Vec3 p = instance.camera_from_part.inverse() * at;
  double best = 1e30;
  for (const auto& t : part.mesh.triangles) {
    const Vec3 a = part.mesh.vertices[t[0]].cast<double>(), b = part.mesh.vertices[t[1]].cast<double>(),
               c = part.mesh.vertices[t[2]].cast<double>();
    for (const Vec3& q : {a, Vec3((a + b) / 2), Vec3((b + c) / 2), Vec3((a + c) / 2), Vec3((a + b + c) / 3)})
      best = std::min(best, (q - p).norm());
  }
  return best;
}

}  // namespace

int main(int argc, char** argv) {
  const auto folder = test::shared_data("real/elbows");
  if (!std::filesystem::exists(folder)) {
    std::printf("SKIPPED: %s is not there (set TRIBIN_DATA)\n", folder.c_str());
    return 0;
  }
  std::vector<Part> parts;
  for (const char* name : {"Pipe_01", "Pipe_02", "Pipe_03"})
    parts.push_back(compile_part(read_cad(folder / "cad" / (std::string(name) + ".stl"), {}), {.name = name}));
  const auto list =
      nlohmann::json::parse(std::ifstream(std::string(TRIBIN_SOURCE_DIR) + "/tests/data/elbows_seen.json"));
  int whole = 0, whole_found = 0, given = 0, off_list = 0, well_laid = 0;
  for (const auto& entry : list["scans"]) {
    ScanReadOptions options;
    options.unit = LengthUnit::metre;
    Scan scan = read_scan(test::shared_data(entry["file"].get<std::string>()), options);
    if (argc > 1) scan.noise.sigma_mm = std::atof(argv[1]);
    if (argc > 2) scan.noise.correlation_px = std::atof(argv[2]);
    std::vector<Seen> seen;
    for (const auto& s : entry["seen"]) {
      const Vec3 at(s["at_mm"][0], s["at_mm"][1], s["at_mm"][2]);
      seen.push_back({s["name"], s["whole"], scan.input_from_camera.inverse() * at});
    }
    const Found found = find_parts(scan, parts);
    std::printf("%s: %d x %d, noise %.2f mm correlated over %.1f px, edges blurred by %.1f px, %s\n",
                scan.source.c_str(), scan.width(), scan.height(), used_sigma(found.surfels),
                found.surfels.correlation_px, make_scene_depth(scan, found.surfels).edge_blur_px, found.status.c_str());
    const auto page =
        std::filesystem::path("build/campaign/elbows") / std::filesystem::path(scan.source).stem().string();
    write_locate_report(page, scan, parts, found,
                        {.command = {}, .files = {scan.source}, .threads = 0, .times = false});
    // The scan of couplers holds no elbows, and the other way round; which of the two elbows is seen nobody has told.
    const bool couplers = scan.source.find("180_") != std::string::npos;
    for (const Instance& instance : found.instances.items) {
      const Part& part =
          *std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; });
      Seen* nearest = nullptr;
      double distance = 10;  // of a point on its surface: a quarter of a tube
      for (Seen& s : seen)
        if (const double d = distance_to(part, instance, s.at);
            !s.found && d < distance && (part.name == "Pipe_01") == couplers)
          nearest = &s, distance = d;
      const Overlay overlay = overlay_of(part, scan, instance);
      ++given;
      if (nearest) nearest->found = true;
      off_list += nearest == nullptr;
      well_laid += overlay.rms_mm <= 2;
      const Vec3 c = scan.input_from_camera * instance.camera_from_part * part.box_center();
      std::printf("  %s score %.2f at %.0f %.0f %.0f, overlay %.2f mm rms, %.0f %% measured: %s\n",
                  instance.part.c_str(), instance.score, c.x(), c.y(), c.z(), overlay.rms_mm,
                  100 * overlay.measured_share,
                  nearest ? nearest->name.c_str() : ("NOT ON THE LIST, see " + (page / "index.html").string()).c_str());
    }
    for (const Instance& instance : found.instances.uncertain)
      std::printf("  uncertain: %s score %.2f\n", instance.part.c_str(), instance.score);
    for (const Reason& r : found.instances.rejected)
      std::printf("  refused: %s %s %s %.3f (limit %.3f), %d times\n", r.part.c_str(), r.stage.c_str(), r.test.c_str(),
                  r.value, r.limit, r.count);
    for (const Seen& s : seen) {
      whole += s.whole;
      whole_found += s.whole && s.found;
      if (s.whole && !s.found) std::printf("  missed: %s\n", s.name.c_str());
    }
  }
  std::printf(
      "seen whole and found: %d of %d (wanted 90 %%); given out %d, off the list %d (wanted 0), overlay within 2 mm "
      "over 60 %% of their points: %d\n",
      whole_found, whole, given, off_list, well_laid);
  return whole_found >= 0.9 * whole && off_list == 0 && well_laid == given ? 0 : 1;
}
