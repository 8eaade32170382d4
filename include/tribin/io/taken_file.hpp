#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tribin/scan/scan.hpp"

namespace tribin {

/// Where the time of a scan and base_from_flange stand: STEM.taken.json beside the scan, whatever its format.
///
/// {"scan_hash": hex, "time": "2026-11-22T11:15:03.250Z", "base_from_flange": {"time", and "rotation" (3 x 3) |
/// "rotation_vector_rad" with "translation_mm", or "convention" with "pose" as the robot shows it}}. All keys may be
/// left out; scan_hash binds it to the bytes of its scan, so that one left over from an earlier scan of the same name
/// is not believed. read_scan and its kin read it, write_scan and write_points write it.
std::filesystem::path taken_file_of(const std::filesystem::path& scan);

/// \throws Error bad_input (file, place, seen, wanted).
Taken read_taken_file(const std::filesystem::path& path);

/// \param scan_bytes  what it belongs to; empty = not bound.
void write_taken_file(const std::filesystem::path& path, const Taken& taken, std::string_view scan_bytes = {});

/// "2026-11-22T11:15:03.250Z" and back. \throws Error bad_input, naming the text, for anything else.
std::string text_of_time(std::int64_t time_ms);
std::int64_t time_from_text(const std::string& text);

/// A pose given as one text: a maker's convention and its numbers, "yaskawa 600 0 900 180 0 0".
/// \throws Error bad_option, naming what was seen and wanted.
Pose robot_pose_from_text(const std::string& text);

}  // namespace tribin
