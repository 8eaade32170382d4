#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "io/lzf.hpp"
#include "tribin/core/image.hpp"

namespace tribin::test {

/// The labels of an mOSD cloud, its first field: 0 invalid, 1-9 table, 20-29 parts of object 1, and so on.
inline Image<std::uint32_t> mosd_labels(const std::filesystem::path& pcd, int width, int height) {
  std::ifstream file(pcd, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(file), {}};
  const std::string mark = "DATA binary_compressed\n";
  const std::size_t begin = all.find(mark) + mark.size();
  std::uint32_t sizes[2];
  std::memcpy(sizes, all.data() + begin, sizeof sizes);
  std::string fields(sizes[1], '\0');
  EXPECT_EQ(io::unpack_lzf(std::string_view(all).substr(begin + 8, sizes[0]), fields), std::string::npos);
  Image<std::uint32_t> labels(width, height, 0);
  EXPECT_GE(fields.size(), labels.size() * sizeof(std::uint32_t));
  std::memcpy(labels.data.data(), fields.data(), labels.size() * sizeof(std::uint32_t));
  return labels;
}

}  // namespace tribin::test
