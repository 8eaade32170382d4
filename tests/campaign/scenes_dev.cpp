// The table scenes of scenes_dev through the whole chain: class, place and rotation of each part against the truth.
// usage: campaign_scenes_dev [FIRST LAST]     (scenes 1 to 4 are tables with one part each)

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tribin/core/error.hpp"
#include "tribin/eval/eval.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/scan_files.hpp"

namespace {

namespace fs = std::filesystem;
using namespace tribin;

constexpr double kAskedVisible = 0.5;  // share of the silhouette that a part must show to be asked for

fs::path scene_dir(const fs::path& data, int scene) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d", scene);
  return data / "test" / name;
}

/// The parts that are offered in a scene, by the names of its scene_parts.json.
std::vector<std::string> offered(const fs::path& scene, const std::vector<eval::Model>& models) {
  std::ifstream file(scene / "scene_parts.json");
  std::vector<std::string> out;
  const nlohmann::json ids = nlohmann::json::parse(file);
  for (int id : ids.at("0")) out.push_back(models.at(id - 1).name);
  return out;
}

int run(const fs::path& data, int first, int last) {
  const std::vector<eval::Model> models = eval::read_bop_models(data / "models");
  std::vector<Part> compiled;
  std::vector<double> translations, rotations, times;
  int asked = 0, found_count = 0, false_count = 0;
  std::printf("scene  asked  found  false   t mm (each)  R deg (each)   ms\n");
  for (int scene = first; scene <= last; ++scene) {
    const fs::path dir = scene_dir(data, scene);
    std::vector<Part> parts;
    for (const std::string& name : offered(dir, models)) {
      auto known = std::find_if(compiled.begin(), compiled.end(), [&](const Part& p) { return p.name == name; });
      if (known == compiled.end()) {
        compiled.push_back(compile_part(read_cad(data / "cad" / (name + ".stl"))));
        known = compiled.end() - 1;
      }
      parts.push_back(*known);
    }
    const Scan scan = read_scan(dir / "depth/000000.png", {.camera_file = dir / "scene_camera.json"});
    const Found found = find_parts(scan, parts);
    const auto truths = eval::read_bop_truth(dir / "scene_gt.json", 0, data / "models");
    const eval::Judgement judged = eval::judge(found.instances.items, truths, models, kAskedVisible);
    asked += judged.asked;
    found_count += static_cast<int>(judged.found.size());
    false_count += static_cast<int>(judged.false_answers.size());
    times.push_back(found.times.total());
    std::printf("%5d %6d %6zu %6zu  ", scene, judged.asked, judged.found.size(), judged.false_answers.size());
    for (const eval::Match& m : judged.found) {
      translations.push_back(m.error.translation_mm);
      rotations.push_back(m.error.rotation / kDegree);
      std::printf(" %.4f/%.4f", translations.back(), rotations.back());
    }
    std::printf("  %.1f  %s\n", times.back(), found.status.c_str());
    for (const Reason& r : found.instances.rejected)
      if (judged.found.empty())
        std::printf("        %s: %s, %s: %.4g, limit %.4g, %d times\n", r.part.c_str(), r.stage.c_str(), r.test.c_str(),
                    r.value, r.limit, r.count);
  }
  const eval::Share share = eval::share_of(found_count, asked);
  std::printf("found %d of %d (95 %% interval %.3f to %.3f), false answers %d\n", share.count, share.of, share.low,
              share.high, false_count);
  std::printf("translation median %.4f mm, 95 %% %.4f mm; rotation median %.4f deg, 95 %% %.4f deg\n",
              eval::quantile(translations, 0.5), eval::quantile(translations, 0.95), eval::quantile(rotations, 0.5),
              eval::quantile(rotations, 0.95));
  std::printf("stages_ms.total median %.1f ms\n", eval::quantile(times, 0.5));
  const bool good = found_count == asked && false_count == 0 && eval::quantile(translations, 0.5) <= 0.1 &&
                    eval::quantile(rotations, 0.5) <= 0.05;
  std::printf("%s: wanted all found, none false, medians <= 0.1 mm and 0.05 deg\n", good ? "PASSED" : "FAILED");
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const char* data = std::getenv("TRIBIN_DATA");
  const fs::path scenes = fs::path(data ? data : "../shared/data") / "scenes_dev";
  if (!fs::exists(scenes)) {
    std::printf("SKIPPED: %s is not there (set TRIBIN_DATA)\n", scenes.c_str());
    return 77;
  }
  try {
    return run(scenes, argc > 2 ? std::atoi(argv[1]) : 1, argc > 2 ? std::atoi(argv[2]) : 4);
  } catch (const tribin::Error& e) {
    std::printf("%s\n", e.what());
    return static_cast<int>(e.code());
  }
}
