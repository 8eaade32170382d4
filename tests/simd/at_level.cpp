// Frames decoded and parts found, with the vectorised loops built for one level: what is printed must not depend on it.
// \return 77 where the processor does not have the level.

#include <cstdio>
#include <cstring>

#include "capture/synthetic_frames.hpp"
#include "support/posed_scan.hpp"
#include "tribin/capture/decode.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/report/json.hpp"

namespace {

using namespace tribin;

bool has_level() {
  if (std::strcmp(TRIBIN_ONE_LEVEL, "avx512f") == 0) return __builtin_cpu_supports("avx512f");
  if (std::strcmp(TRIBIN_ONE_LEVEL, "avx2") == 0) return __builtin_cpu_supports("avx2");
  return true;
}

void print_bits(const char* name, const Image<float>& image) {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (const float value : image.data) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    for (int k = 0; k < 4; ++k) hash = (hash ^ (bits >> (8 * k) & 255)) * 1099511628211u;
  }
  std::printf("%s %016llx\n", name, static_cast<unsigned long long>(hash));
}

}  // namespace

int main() {
  if (!has_level()) return 77;
  for (const int steps : {3, 4}) {
    const auto patterns = make_patterns({.code = PatternCode::gray, .steps = steps});
    const Decoded d = decode(test::synthetic_frames(
        patterns, 301, 97, {.modulation = 40, .blur_px = 0}, 5, [](int u, int) { return 2.0 + 4.1 * u; },
        [](int, int v) { return 3.0 + 8 * v; }, [](int, int) { return 1.0; }));
    print_bits("column", d.column);
    print_bits("row", d.row);
  }
  std::vector<Part> parts;
  for (const char name : {'a', 'b'})
    parts.push_back(
        compile_part(read_cad(std::string(TRIBIN_SOURCE_DIR) + "/examples/parts/alternator_" + name + ".stl", {}),
                     {.name = std::string("alternator_") + name}));
  for (unsigned seed = 1; seed <= 3; ++seed) {
    // An odd width: rows end in part of a vector.
    const Scan scan = test::posed_scan({{&parts[seed % 2].mesh, test::random_pose(700, seed)}}, Vec3(0, 0, -1), -950,
                                       0.1, 0.8, seed, 701, 533);
    std::printf("%s\n", locate_json(scan, find_parts(scan, parts), {.times = false}).c_str());
  }
  return 0;
}
