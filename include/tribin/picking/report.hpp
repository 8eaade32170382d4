#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tribin/core/image.hpp"
#include "tribin/picking/cycle.hpp"

/// What a run tells: JSON lines for programs, a page for people.
namespace tribin::picking {

/// One line of JSON, without its end; schema/pick_cycle.schema.json.
std::string line_of(const CycleReport& report);
/// The last line of a run. \param filling  of the rack
std::string line_of(const RunEnd& end, const Filling& filling);

/// A scan as a small grey picture, lit from the camera's upper left; holes are black.
Image<std::uint8_t> picture_of(const Scan& scan);

/// A run as a page, in one file: a film of its scans with what came of each, the rack, the cycles, the reasons.
class RunPage {
 public:
  /// \param folder  made where it is missing. \throws Error bad_input where it cannot be written
  explicit RunPage(std::filesystem::path folder);
  /// The next scan.
  void show(const Image<std::uint8_t>& picture);
  void add(const CycleReport& report);
  /// Writes index.html.
  void finish(const WorkCell& cell_file, const RunEnd& end, const Filling& filling) const;

 private:
  std::string film() const;
  std::string cycles() const;

  std::filesystem::path folder_;
  std::vector<std::string> pictures_;              ///< as PNG
  std::vector<std::pair<int, CycleReport>> rows_;  ///< number of the picture from 1, 0 = none; what came of it
};

}  // namespace tribin::picking
