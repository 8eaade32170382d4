#pragma once

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "peer_exchange.hpp"

// What tribin bench --peers and a peer exchange: raw little-endian files and one line on stdout.
//   peer CLOUD OUT width height fx fy cx cy [MODEL...]
//   CLOUD  float32 x y z a pixel, row-major, mm, NaN = none; peers for segmentation and pose get 6 floats, the normal
//          behind
//   MODEL  pose peers: float32 x y z nx ny nz of points on the part [mm], as many as there are
//   OUT    normals: float32 x y z a pixel; labels: int32 a pixel, 0 = none, bit 16 set for cylinders; poses: text
//   stdout {"ms": CPU time of the algorithm alone, without reading and converting}
namespace peer {

struct Request {
  std::string cloud, out;
  std::vector<std::string> models;
  int width = 0, height = 0;
  float fx = 0, fy = 0, cx = 0, cy = 0;
};

inline Request read_request(int argc, char** argv) {
  if (argc < 9) {
    std::fprintf(stderr, "usage: %s CLOUD OUT width height fx fy cx cy [MODEL...]\n", argv[0]);
    std::exit(2);
  }
  const auto number = [&](int i) { return std::strtof(argv[i], nullptr); };
  return {argv[1],   argv[2],  {argv + 9, argv + argc}, std::atoi(argv[3]), std::atoi(argv[4]), number(5), number(6),
          number(7), number(8)};
}

inline std::vector<float> read_floats(const std::string& path, std::size_t count) {
  std::vector<float> values = read_raw<float>(path, count);
  if (values.size() != count) {
    std::fprintf(stderr, "%s: %zu floats were wanted\n", path.c_str(), count);
    std::exit(3);
  }
  return values;
}

/// All of a model's points, 6 floats each.
inline std::vector<float> read_model(const std::string& path) {
  return read_floats(path, std::filesystem::file_size(path) / sizeof(float));
}

class Stopwatch {
 public:
  /// Writes the line that is wanted on stdout.
  void report() const { std::printf("{\"ms\": %.3f}\n", ms()); }
  double ms() const { return 1000.0 * static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

}  // namespace peer
