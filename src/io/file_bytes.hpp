#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/core/error.hpp"

namespace tribin::io {

/// A file in memory, and its name for messages. All parsers take this, so that they can be fuzzed without files.
struct FileBytes {
  std::string name;
  std::string data;

  std::string_view view() const { return data; }
  std::size_t size() const { return data.size(); }
};

/// Reads a whole file.
/// \throws Error bad_input for what is missing, a folder, empty or unreadable.
FileBytes read_file(const std::filesystem::path& path);

/// Throws bad_input as one sentence: "FILE: PLACE: saw SEEN, wanted WANTED".
[[noreturn]] void bad_file(std::string_view file, std::string_view place, std::string_view seen,
                           std::string_view wanted, ErrorCode code = ErrorCode::bad_input);

/// "byte 123"
std::string at_byte(std::size_t offset);
/// "line 12" of the line that holds the offset.
std::string at_line(std::string_view text, std::size_t offset);
/// A piece of foreign text, fit for a message: short, printable, in quotes.
std::string in_quotes(std::string_view text);

/// No scan or mesh of the field needs more points than this; larger claims are refused before anything is allocated.
inline constexpr std::size_t kMaxPoints = 100'000'000;

std::string lower_extension(const std::filesystem::path& path);

}  // namespace tribin::io
