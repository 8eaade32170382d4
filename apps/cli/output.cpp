#include "output.hpp"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <iostream>
#include <mutex>
#include <set>
#include <thread>

#include "tribin/core/error.hpp"

namespace fs = std::filesystem;

namespace tribin::cli {
namespace {

// Folders to remove when a signal ends the program. A leaked pointer: the watching thread may outlive statics.
struct Registry {
  std::mutex mutex;
  std::set<fs::path> folders;
};
Registry& registry() {
  static Registry* const instance = new Registry;
  return *instance;
}

void move_into_place(const fs::path& from, const fs::path& to) {
  if (fs::is_directory(from)) {
    fs::create_directories(to);
    for (const fs::directory_entry& entry : fs::directory_iterator(from))
      move_into_place(entry.path(), to / entry.path().filename());
  } else {
    fs::rename(from, to);
  }
}

}  // namespace

void clean_up_on_signal() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // inherited by all later threads: only the watcher sees them
  std::thread([signals] {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0) return;
    const std::lock_guard lock(registry().mutex);
    std::error_code ignored;
    for (const fs::path& folder : registry().folders) fs::remove_all(folder, ignored);
    _exit(128 + signal);
  }).detach();
}

RemovedOnSignal::RemovedOnSignal(const fs::path& folder) : folder_(fs::absolute(folder)) {
  const std::lock_guard lock(registry().mutex);
  registry().folders.insert(folder_);
}

RemovedOnSignal::~RemovedOnSignal() {
  const std::lock_guard lock(registry().mutex);
  registry().folders.erase(folder_);
}

StagedOutput::StagedOutput(const fs::path& final_place) : final_(fs::absolute(final_place).lexically_normal()) {
  if (!final_.has_filename()) final_ = final_.parent_path();  // "out/" means the folder out
  const fs::path parent = final_.parent_path();
  if (!fs::is_directory(parent))
    throw Error(ErrorCode::bad_option, final_place.string() + ": the folder " + parent.string() + " does not exist");
  folder_ = parent / (".tribin-" + final_.filename().string() + "-" + std::to_string(getpid()));
  {
    const std::lock_guard lock(registry().mutex);
    registry().folders.insert(folder_);
  }
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error)
    throw Error(ErrorCode::bad_option,
                final_place.string() + ": cannot write into " + parent.string() + ": " + error.message());
}

StagedOutput::~StagedOutput() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  const std::lock_guard lock(registry().mutex);
  registry().folders.erase(folder_);
}

fs::path StagedOutput::path() const { return folder_ / final_.filename(); }

void StagedOutput::publish() {
  try {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
      move_into_place(entry.path(), final_.parent_path() / entry.path().filename());
  } catch (const fs::filesystem_error& e) {
    throw Error(ErrorCode::bad_option, final_.string() + ": cannot be written: " + e.code().message());
  }
}

void write_text(const std::string& where, const std::string& text) {
  if (where == "-") {
    std::cout << text << std::flush;
    return;
  }
  StagedOutput staged(where);
  std::ofstream file(staged.path(), std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error(ErrorCode::bad_option, where + ": cannot be written (is the disk full?)");
  staged.publish();
}

}  // namespace tribin::cli
