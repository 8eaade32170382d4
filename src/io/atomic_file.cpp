#include "io/atomic_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "io/file_bytes.hpp"

namespace tribin::io {

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  // The process id keeps two writers of one file apart; the name never enters a result.
  const std::filesystem::path beside = path.string() + "." + std::to_string(::getpid()) + ".part";
  const auto give_up = [&](const std::string& what) {
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    bad_file(path.string(), "", what, "a file that can be written");
  };
  if (std::filesystem::is_directory(path)) bad_file(path.string(), "", "a folder", "a file that can be written");
  std::FILE* handle = std::fopen(beside.c_str(), "wb");
  if (!handle) bad_file(path.string(), "", std::strerror(errno), "a file that can be written");
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), handle) == bytes.size();
  const int write_error = errno;
  if (std::fclose(handle) != 0 || !written) give_up(std::strerror(written ? errno : write_error));
  std::error_code error;
  std::filesystem::rename(beside, path, error);
  if (error) give_up(error.message());
}

}  // namespace tribin::io
