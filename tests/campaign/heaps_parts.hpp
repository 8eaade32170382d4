#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace tribin::campaign {

/// The CAD files that heaps are drawn from, as `--part` takes them: the example alternators, and real parts of the
/// shared data where they are there (World Robot Challenge 2020, Open CASCADE's samples). They span 43 to 190 mm;
/// the simulator puts parts of like size together.
inline std::vector<std::string> heap_parts() {
  namespace fs = std::filesystem;
  std::vector<std::string> out = {"alternator_a=examples/parts/alternator_a.stl",
                                  "alternator_b=examples/parts/alternator_b.stl"};
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
