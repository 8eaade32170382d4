#include "peer_process.hpp"

#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>

namespace tribin::cli {

namespace fs = std::filesystem;

fs::path peer_folder() { return fs::read_symlink("/proc/self/exe").parent_path() / "peers"; }

std::map<std::string, double> run_peer(const fs::path& program, const fs::path& in, const fs::path& out,
                                       const PinholeCamera& camera, const std::vector<fs::path>& models, int most_s) {
  std::string command;
  if (most_s > 0) command = "timeout " + std::to_string(most_s) + " ";
  for (const fs::path& word : {program, in, out}) command += "'" + word.string() + "' ";
  command += std::to_string(camera.width) + " " + std::to_string(camera.height);
  for (const double x : {camera.fx, camera.fy, camera.cx, camera.cy}) command += " " + std::to_string(x);
  for (const fs::path& model : models) command += " '" + model.string() + "'";
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return {};
  char line[256] = {};
  const bool answered = std::fgets(line, sizeof line, pipe) != nullptr;
  if (pclose(pipe) != 0 || !answered) return {};
  const nlohmann::json answer = nlohmann::json::parse(line, nullptr, false);
  std::map<std::string, double> times;
  if (answer.is_object())
    for (const auto& [key, value] : answer.items())
      if (value.is_number()) times[key] = value.get<double>();
  return times;
}

double cpu_ms() { return 1000.0 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace tribin::cli
