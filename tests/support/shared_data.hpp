#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace tribin::test {

/// A file of the shared test data: below TRIBIN_DATA, by default ../shared/data beside the project.
inline std::filesystem::path shared_data(const std::filesystem::path& name) {
  const char* root = std::getenv("TRIBIN_DATA");
  return (root ? std::filesystem::path(root) : std::filesystem::path(TRIBIN_SOURCE_DIR) / ".." / "shared" / "data") /
         name;
}

}  // namespace tribin::test

/// Skips the test, with the reason, where a file of the shared data is absent.
#define TRIBIN_NEED_DATA(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << (path) << " is absent (set TRIBIN_DATA)"
