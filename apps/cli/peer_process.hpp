#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "peer_exchange.hpp"
#include "tribin/core/camera.hpp"

namespace tribin::cli {

/// The folder of the peers' programs (bench/peers, -DTRIBIN_PEERS=ON).
std::filesystem::path peer_folder();

/// Runs a peer (bench/peers/peer_io.hpp tells what it gets). \return its CPU milliseconds by each key of its
/// answer, "ms" for most; empty when it failed, or was stopped since it took longer than `most_s`; 0 = no limit.
std::map<std::string, double> run_peer(const std::filesystem::path& program, const std::filesystem::path& in,
                                       const std::filesystem::path& out, const PinholeCamera& camera,
                                       const std::vector<std::filesystem::path>& models = {}, int most_s = 0);

/// CPU time of this process [ms], as the peers tell theirs: fair on a busy machine.
double cpu_ms();

}  // namespace tribin::cli
