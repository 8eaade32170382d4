#pragma once

#include <span>
#include <string>
#include <vector>

#include "tribin/eval/bop_dataset.hpp"
#include "tribin/report/json.hpp"

namespace tribin {

// What `tribin bop` writes: one record an image, and BOP's result CSV, which follows from the records.

/// The result of `locate` for one image, on one line, with `scene_id`, `im_id` and `offered` (obj_id and part) before
/// the rest.
/// \param objects  of the data set; the task's are named in `offered`.
std::string bop_record(const eval::BopTask& task, std::span<const eval::BopObject> objects, const Scan& scan,
                       const Found& found, const JsonOptions& options = {});

/// A line of results with the numbers of its image, to sort by.
struct BopLine {
  int scene = 0;
  int image = 0;
  std::string text;  ///< with its newline
};

/// The rows of BOP's result CSV for one record, best first; the time is that of `stages_ms.total` [s], -1 without.
/// \throws Error bad_input for what is no record; `file` and `line` say where it stands.
std::vector<BopLine> bop_csv_rows(const std::string& record, const std::string& file, int line);

/// The lines of a result file, CSV (its head left out) or NDJSON by the extension, in the file's order.
/// \throws Error bad_input, naming file and line.
std::vector<BopLine> read_bop_lines(const std::filesystem::path& file);

/// Lines of several files as one file: by scene and image, those of an image in their own order; a CSV gets its head.
/// An image that stands in several files is taken once where they agree.
/// \throws Error bad_input where they do not.
std::string merged_bop_lines(const std::vector<std::vector<BopLine>>& files, bool csv);

}  // namespace tribin
