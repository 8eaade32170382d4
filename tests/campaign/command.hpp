#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "tribin/core/content_hash.hpp"

// Campaigns that drive the command line, so that what they measure is what a user gets.
namespace tribin::campaign {

inline std::string quoted(const std::string& word) { return "'" + word + "'"; }

/// Runs the command line. \return whether it succeeded.
inline bool run_tribin(const std::vector<std::string>& arguments) {
  std::string command = TRIBIN_CLI;
  for (const std::string& argument : arguments) command += " " + quoted(argument);
  std::fflush(stdout);
  return std::system(command.c_str()) == 0;
}

/// Names the program that is measured, so that the results of two builds never mix.
inline std::string program_hash() {
  std::ifstream file(TRIBIN_CLI, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return hex_of(content_hash(bytes)).substr(0, 8);
}

/// `tribin bop` on a data set, a shard a core, joined. What is done already is kept.
/// \return the joined NDJSON; empty when a shard failed.
inline std::filesystem::path run_bop(const std::filesystem::path& data, const std::filesystem::path& targets) {
  namespace fs = std::filesystem;
  const fs::path out = data.string() + ".results_" + program_hash();
  fs::create_directories(out);
  const int shards = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::string> files;
  std::vector<std::thread> runs;
  std::vector<char> good(static_cast<std::size_t>(shards), 0);
  for (int i = 0; i < shards; ++i) {
    files.push_back((out / ("shard_" + std::to_string(i) + ".csv")).string());
    std::vector<std::string> arguments = {
        "bop", data.string(), "--shard",   std::to_string(i) + "/" + std::to_string(shards), "--threads", "1",
        "-q",  "-o",          files.back()};
    if (!targets.empty()) arguments.insert(arguments.end(), {"--targets", targets.string()});
    runs.emplace_back([&good, i, arguments] { good[i] = run_tribin(arguments); });
  }
  for (std::thread& run : runs) run.join();
  for (const char g : good)
    if (!g) return {};
  std::vector<std::string> merge = {"merge"};
  merge.insert(merge.end(), files.begin(), files.end());
  merge.insert(merge.end(), {"-o", (out / "results.csv").string()});
  return run_tribin(merge) ? out / "results.ndjson" : fs::path();
}

}  // namespace tribin::campaign
