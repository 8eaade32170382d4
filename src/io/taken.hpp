#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/scan/scan.hpp"

namespace tribin::io {

/// What stands beside a scan about its time and place, if it is of these bytes.
void read_taken(const std::filesystem::path& scan, std::string_view bytes, Taken& taken,
                std::vector<std::string>& warnings);

/// Writes a scan's bytes, and what is known of its time and place beside it.
void write_scan_file(const std::filesystem::path& path, const Taken& taken, std::string_view bytes);

}  // namespace tribin::io
