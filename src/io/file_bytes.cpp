#include "io/file_bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace tribin::io {

void bad_file(std::string_view file, std::string_view place, std::string_view seen, std::string_view wanted,
              ErrorCode code) {
  std::string message(file);
  if (!place.empty()) message.append(": ").append(place);
  message.append(": saw ").append(seen).append(", wanted ").append(wanted);
  throw Error(code, message);
}

std::string at_byte(std::size_t offset) { return "byte " + std::to_string(offset); }

std::string at_line(std::string_view text, std::size_t offset) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(offset, text.size()));
  return "line " + std::to_string(1 + std::count(text.begin(), end, '\n'));
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string out = "\"";
  for (char c : text.substr(0, kLongest)) out += (c >= 32 && c < 127 && c != '"') ? c : '?';
  return out + (text.size() > kLongest ? "...\"" : "\"");
}

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return extension;
}

FileBytes read_file(const std::filesystem::path& path) {
  constexpr std::size_t kLargest = std::size_t{4} << 30;  // a 100 Mpx cloud of 40 bytes a point
  FileBytes file{path.string(), {}};
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) bad_file(file.name, "", "no such file", "a readable file");
  if (std::filesystem::is_directory(status)) bad_file(file.name, "", "a folder", "a file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> handle(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!handle) bad_file(file.name, "", std::strerror(errno), "a readable file");
  if (std::filesystem::is_regular_file(status)) {
    const auto size = std::filesystem::file_size(path, error);
    if (!error && size > kLargest) bad_file(file.name, "", std::to_string(size) + " bytes", "a file below 4 GiB");
    if (!error) file.data.resize(static_cast<std::size_t>(size));
  }
  // The size is only a hint: a pipe has none, and a file may change while it is read.
  std::size_t filled = 0;
  for (;;) {
    if (filled == file.data.size()) {
      char probe;
      if (std::fread(&probe, 1, 1, handle.get()) != 1) break;
      if (filled >= kLargest) bad_file(file.name, "", "more than 4 GiB", "a file below 4 GiB");
      file.data.push_back(probe);
      file.data.resize(std::max<std::size_t>(2 * file.data.size(), 1 << 16));
      ++filled;
    }
    const std::size_t got = std::fread(file.data.data() + filled, 1, file.data.size() - filled, handle.get());
    if (got == 0) break;
    filled += got;
  }
  if (std::ferror(handle.get())) bad_file(file.name, at_byte(filled), "a read error", "a readable file");
  file.data.resize(filled);
  if (file.data.empty()) bad_file(file.name, "", "an empty file", "a scan or a CAD file");
  return file;
}

}  // namespace tribin::io
