#include <cstdio>

#include "io/file_bytes.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/io/taken_file.hpp"

namespace tribin {
namespace {

// Clocks of two machines differ by some milliseconds under NTP; a scan a second ahead says that one is not set.
constexpr std::int64_t kClockSlackMs = 1000;

std::string seconds(std::int64_t ms) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f s", static_cast<double>(ms) / 1000);
  return text;
}

void check_age(const WorkCell& cell, const Taken& taken, const std::string& scan, std::int64_t now_ms) {
  if (!taken.time_ms)
    io::bad_file(scan, "", "no time of the scan", "it in " + taken_file_of(scan).string() + ": motion goes by it");
  const std::int64_t age = now_ms - *taken.time_ms;
  if (age < -kClockSlackMs)
    io::bad_file(scan, "", "a scan of " + text_of_time(*taken.time_ms) + ", " + seconds(-age) + " ahead of the clock",
                 "clocks that agree", ErrorCode::out_of_range);
  if (static_cast<double>(age) > 1000 * cell.safety.scan_max_age_s)
    io::bad_file(scan, "", "a scan " + seconds(age) + " old",
                 "at most " + seconds(static_cast<std::int64_t>(1000 * cell.safety.scan_max_age_s)) +
                     " (safety.scan_max_age_s of " + cell.file.string() + ")",
                 ErrorCode::out_of_range);
}

void check_flange(const Taken& taken, const std::string& scan) {
  const std::string wanted = " in " + taken_file_of(scan).string() + ", as the camera is on the flange";
  if (!taken.base_from_flange) io::bad_file(scan, "", "no base_from_flange", "it" + wanted);
  if (!taken.time_ms) io::bad_file(scan, "", "no time of the scan", "it" + wanted);
  if (!taken.flange_time_ms) io::bad_file(scan, "", "no time of base_from_flange", "it" + wanted);
  if (*taken.flange_time_ms < *taken.time_ms)
    io::bad_file(scan, "",
                 "base_from_flange " + seconds(*taken.time_ms - *taken.flange_time_ms) + " older than the scan",
                 "one told while or after it was taken: the robot may have moved", ErrorCode::out_of_range);
}

}  // namespace

Pose base_from_camera(const WorkCell& cell, const std::optional<Pose>& base_from_flange) {
  if (cell.mount() == CameraMount::fixed) return cell.hand_eye.parent_from_camera;
  if (!base_from_flange)
    io::bad_file(cell.file.string(), "camera.mount", "\"hand\", and no base_from_flange of the scan",
                 "where the flange was when the scan was taken");
  return *base_from_flange * cell.hand_eye.parent_from_camera;
}

Pose base_from_camera(const WorkCell& cell, const Taken& taken, const std::string& scan,
                      std::optional<std::int64_t> now_ms) {
  if (cell.mount() == CameraMount::hand) check_flange(taken, scan);
  if (now_ms) check_age(cell, taken, scan, *now_ms);
  return base_from_camera(cell, taken.base_from_flange);
}

}  // namespace tribin
