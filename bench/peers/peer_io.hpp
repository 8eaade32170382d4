#pragma once

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

// What tribin bench --peers and a peer exchange: raw little-endian files and one line on stdout.
//   peer CLOUD OUT width height fx fy cx cy
//   CLOUD  float32 x y z a pixel, row-major, mm, NaN = none; a segmentation peer gets 6 floats, the normal behind
//   OUT    normals: float32 x y z a pixel; labels: int32 a pixel, 0 = none, bit 16 set for cylinders
//   stdout {"ms": CPU time of the algorithm alone, without reading and converting}
namespace peer {

struct Request {
  std::string cloud, out;
  int width = 0, height = 0;
  float fx = 0, fy = 0, cx = 0, cy = 0;
};

inline constexpr int kCylinderBit = 1 << 16;

inline Request read_request(int argc, char** argv) {
  if (argc != 9) {
    std::fprintf(stderr, "usage: %s CLOUD OUT width height fx fy cx cy\n", argv[0]);
    std::exit(2);
  }
  const auto number = [&](int i) { return std::strtof(argv[i], nullptr); };
  return {argv[1], argv[2], std::atoi(argv[3]), std::atoi(argv[4]), number(5), number(6), number(7), number(8)};
}

inline std::vector<float> read_floats(const std::string& path, std::size_t count) {
  std::vector<float> values(count);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(float)));
  if (!file) {
    std::fprintf(stderr, "%s: %zu floats were wanted\n", path.c_str(), count);
    std::exit(3);
  }
  return values;
}

template <class T>
void write_values(const std::string& path, const std::vector<T>& values) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
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
