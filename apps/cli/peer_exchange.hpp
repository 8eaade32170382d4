#pragma once

#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

// The raw files that tribin bench --peers and the peers' programs (bench/peers) hand each other; the standard library
// alone, so that a peer needs nothing of tribin.
namespace peer {

/// Set in the labels of pixels that a segmentation peer takes for a cylinder's.
inline constexpr int kCylinderBit = 1 << 16;

template <class T>
void write_raw(const std::string& path, const std::vector<T>& values) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

/// Empty where the file does not hold that many.
template <class T>
std::vector<T> read_raw(const std::string& path, std::size_t count) {
  std::vector<T> values(count);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  if (!file) values.clear();
  return values;
}

/// A pose that a peer gives out: a line of its answer, "model score r00 r01 .. r22 tx ty tz".
struct PeerPose {
  int model = 0;  ///< place in the list of models that it was given
  double score = 0;
  double rotation[9] = {};
  double translation_mm[3] = {};
};

inline void write_poses(const std::string& path, const std::vector<PeerPose>& poses) {
  std::ofstream file(path);
  file.precision(12);
  for (const PeerPose& pose : poses) {
    file << pose.model << ' ' << pose.score;
    for (const double x : pose.rotation) file << ' ' << x;
    for (const double x : pose.translation_mm) file << ' ' << x;
    file << '\n';
  }
}

inline std::vector<PeerPose> read_poses(const std::string& path) {
  std::ifstream file(path);
  std::vector<PeerPose> poses;
  for (PeerPose pose; file >> pose.model >> pose.score;) {
    for (double& x : pose.rotation) file >> x;
    for (double& x : pose.translation_mm) file >> x;
    if (file) poses.push_back(pose);
  }
  return poses;
}

}  // namespace peer
