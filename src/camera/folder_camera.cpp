#include "tribin/camera/folder_camera.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "camera/shot_folder.hpp"
#include "io/file_bytes.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;

class FolderCamera : public Camera {
 public:
  FolderCamera(fs::path folder, std::vector<fs::path> shots, fs::path frames_file)
      : folder_(std::move(folder)), shots_(std::move(shots)), frames_file_(std::move(frames_file)) {}

  std::string name() const override { return folder_.string(); }

  Shot grab() override {
    if (next_ == shots_.size())
      io::bad_file(folder_.string(), "", "no shot after the " + std::to_string(next_) + " that it holds", "one more",
                   ErrorCode::too_little_data);
    return camera::read_shot(shots_[next_++], frames_file_);
  }

 private:
  fs::path folder_;
  std::vector<fs::path> shots_;
  fs::path frames_file_;
  std::size_t next_ = 0;
};

std::string numbered(int number) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d", number);
  return name;
}

/// The number of a shot's folder, 0 for other names.
int number_of(const fs::path& folder) {
  const std::string name = folder.filename().string();
  if (name.size() != 6 || name.find_first_not_of("0123456789") != std::string::npos) return 0;
  return std::stoi(name);
}

}  // namespace

std::unique_ptr<Camera> open_folder_camera(const fs::path& folder, const fs::path& frames_file) {
  if (!fs::is_directory(folder))
    io::bad_file(folder.string(), "", fs::exists(folder) ? "a file" : "no such folder", "a folder of frames or shots");
  if (!frames_file.empty() || camera::is_shot(folder))
    return std::make_unique<FolderCamera>(folder, std::vector<fs::path>{folder}, frames_file);
  std::vector<fs::path> shots;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && camera::is_shot(entry.path())) shots.push_back(entry.path());
  std::sort(shots.begin(), shots.end());
  if (shots.empty()) io::bad_file(folder.string(), "", "no frames.json", "one, or folders of recorded shots");
  return std::make_unique<FolderCamera>(folder, std::move(shots), fs::path());
}

fs::path record_shot(const fs::path& recording, const Shot& shot) {
  // Written beside the shots and renamed; the process id keeps two writers apart.
  const fs::path beside = recording / (".unfinished-" + std::to_string(::getpid()));
  try {
    fs::create_directories(recording);
    fs::remove_all(beside);
    camera::write_shot(beside, shot);
    int last = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(recording))
      last = std::max(last, number_of(entry.path()));
    for (int number = last + 1;; ++number) {
      std::error_code taken;
      fs::rename(beside, recording / numbered(number), taken);  // fails where another writer was quicker
      if (!taken) return recording / numbered(number);
      if (!fs::exists(recording / numbered(number))) throw fs::filesystem_error("rename", beside, taken);
    }
  } catch (const fs::filesystem_error& e) {
    std::error_code ignored;
    fs::remove_all(beside, ignored);
    io::bad_file(recording.string(), "", e.code().message(), "a folder that can be written");
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(beside, ignored);
    throw;
  }
}

}  // namespace tribin
