#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "support/near_symmetric.hpp"
#include "tribin/io/write.hpp"

namespace tribin::campaign {

/// Four plain parts of our own, 60 to 90 mm: an angle, a wedge, a tee and a stepped shaft.
inline std::vector<std::pair<std::string, Mesh>> own_parts() {
  return {
      {"own_angle", test::prism({{45, -5}, {45, 10}, {10, 10}, {5, 50}, {-12, 50}, {-12, -8}, {30, -8}}, 30)},
      {"own_wedge", test::prism({{40, -15}, {25, 25}, {-30, 30}, {-35, -20}}, 24)},
      {"own_tee", test::prism({{35, 15}, {-35, 15}, {-35, -2}, {-9, -2}, {-8, -40}, {8, -40}, {9, -2}, {35, -2}}, 22)},
      {"own_shaft", test::turned({{8, 0}, {8, 20}, {16, 20}, {16, 45}, {11, 45}, {11, 80}}, 72)}};
}

/// The CAD files that heaps are drawn from, as `--part` takes them: the example alternators, our own, and real parts of
/// the shared data where they are there (World Robot Challenge 2020, Open CASCADE's samples). They span 43 to 190 mm;
/// the simulator puts parts of like size together. \param folder  where our own are written.
inline std::vector<std::string> heap_parts(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> out = {"alternator_a=examples/parts/alternator_a.stl",
                                  "alternator_b=examples/parts/alternator_b.stl"};
  fs::create_directories(folder);
  for (const auto& [name, mesh] : own_parts()) {
    const fs::path file = folder / (name + ".stl");
    if (!fs::exists(file)) write_mesh(file, mesh);
    out.push_back(file.string());
  }
  const char* data = std::getenv("TRIBIN_DATA");
  const fs::path cad = fs::path(data ? data : "../shared/data") / "cad";
  for (const auto& [name, file] : {std::pair{"gear_motor", "o2ac/04_37D-GEARMOTOR-50-70.stl"},
                                   {"bearing_housing", "o2ac/07_SBARB6200ZZ_30.stl"},
                                   {"pulley_60", "o2ac/11_MBRAC60-2-10.stl"},
                                   {"pulley_80", "o2ac/37_MBRAC80-2-10.stl"},
                                   {"gear_60", "o2ac/51_MBGNA60-2.stl"},
                                   {"idler_45", "o2ac/33_MBRFA45-2-P6.stl"},
                                   {"panel", "o2ac/02-PANEL.stl"},
                                   {"component_8", "occt/component8.step"}})
    if (fs::exists(cad / file)) out.push_back(std::string(name) + "=" + (cad / file).string());
  return out;
}

}  // namespace tribin::campaign
