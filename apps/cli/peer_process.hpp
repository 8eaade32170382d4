#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "tribin/core/camera.hpp"

namespace tribin::cli {

/// The folder of the peers' programs (bench/peers, -DTRIBIN_PEERS=ON).
std::filesystem::path peer_folder();

/// Runs a peer (bench/peers/peer_io.hpp tells what it gets). \return its CPU milliseconds by each key of its
/// answer, "ms" for most; empty when it failed.
std::map<std::string, double> run_peer(const std::filesystem::path& program, const std::filesystem::path& in,
                                       const std::filesystem::path& out, const PinholeCamera& camera);

/// CPU time of this process [ms], as the peers tell theirs: fair on a busy machine.
double cpu_ms();

template <class T>
void write_raw(const std::filesystem::path& path, const std::vector<T>& values) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

/// Empty where the file does not hold that many.
template <class T>
std::vector<T> read_raw(const std::filesystem::path& path, std::size_t count) {
  std::vector<T> values(count);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  if (!file) values.clear();
  return values;
}

}  // namespace tribin::cli
