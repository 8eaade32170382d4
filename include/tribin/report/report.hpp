#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tribin/eval/eval.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin {

/// What the report says beside the result itself.
struct ReportContext {
  std::vector<std::string> command;          ///< argv, to run it again
  std::vector<std::filesystem::path> files;  ///< inputs, whose SHA-256 is given
  int threads = 0;
  bool times = true;  ///< false: the same input gives the same page
};

/// The truth of a simulated scan.
struct ReportTruth {
  std::vector<eval::Truth> truths;
  std::vector<eval::Model> models;
};

/// Writes DIR/index.html, one self-contained page (no network, no script, light and dark, A4), and DIR/report.json, the
/// same bytes as locate_json. Order: verdict, warnings, poses, ten pictures a part, evidence, why not, time, run it
/// again. \param dir  is made when missing. \throws Error bad_option when the folder cannot be written.
void write_locate_report(const std::filesystem::path& dir, const Scan& scan, std::span<const Part> parts,
                         const Found& found, const ReportContext& context,
                         const std::optional<ReportTruth>& truth = {});

/// The same for a segmentation without parts, of a scan or of loose points.
void write_segment_report(const std::filesystem::path& dir, const Surfels& surfels, const Primitives& primitives,
                          const PrimitiveModel& model, const StageTimes& times, const std::vector<Warning>& warnings,
                          const ReportContext& context);

/// The same for a CAD file: primitives, symmetry, findability.
void write_part_report(const std::filesystem::path& dir, const Part& part, const std::string& file,
                       const StageTimes& times, const ReportContext& context);

}  // namespace tribin
