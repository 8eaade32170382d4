#pragma once

#include <filesystem>
#include <string>

namespace tribin::cli {

/// Makes Ctrl-C and TERM remove what is half written before the program ends (exit code 130, 143). Call it before any
/// thread starts.
void clean_up_on_signal();

/// A folder beside the wanted output, in which files are written under their own names; `publish` moves them to their
/// place, and what is not published is gone at the end, Ctrl-C included. So no reader ever sees half a file.
class StagedOutput {
 public:
  /// \param final_place  the file or folder to be written; its parent must exist.
  /// \throws Error bad_option when the parent folder is missing or cannot be written.
  explicit StagedOutput(const std::filesystem::path& final_place);
  ~StagedOutput();
  StagedOutput(const StagedOutput&) = delete;
  StagedOutput& operator=(const StagedOutput&) = delete;

  /// Where to write: the final name inside the hidden folder.
  std::filesystem::path path() const;
  /// Moves all that was written to its place: files over files of the same name, folders file by file.
  void publish();

 private:
  std::filesystem::path final_;
  std::filesystem::path folder_;
};

/// A folder that is removed when a signal ends the program while this object lives.
class RemovedOnSignal {
 public:
  explicit RemovedOnSignal(const std::filesystem::path& folder);
  ~RemovedOnSignal();
  RemovedOnSignal(const RemovedOnSignal&) = delete;
  RemovedOnSignal& operator=(const RemovedOnSignal&) = delete;

 private:
  std::filesystem::path folder_;
};

/// Writes text to a file (by StagedOutput), or to stdout for "-".
void write_text(const std::string& where, const std::string& text);

}  // namespace tribin::cli
