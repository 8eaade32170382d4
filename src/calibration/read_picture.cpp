#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "io/file_bytes.hpp"
#include "tribin/calibration/find_board.hpp"

namespace tribin {

Image<std::uint8_t> to_8_bit(const Image<std::uint16_t>& picture) {
  Image<std::uint8_t> out(picture.width, picture.height);
  if (picture.empty()) return out;
  // One pixel in a thousand may be brighter: hot pixels.
  std::vector<std::uint16_t> values = picture.data;
  const auto brightest = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) - values.size() / 1000);
  std::nth_element(values.begin(), brightest, values.end());
  const double scale = 255.0 / std::max<double>(1, *brightest);
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] = static_cast<std::uint8_t>(std::min(255L, std::lround(scale * picture.data[i])));
  return out;
}

Image<std::uint8_t> read_picture(const std::filesystem::path& path) {
  const io::FileBytes file = io::read_file(path);
  cv::Mat picture;
  try {
    const cv::Mat bytes(1, static_cast<int>(file.data.size()), CV_8UC1, const_cast<char*>(file.data.data()));
    picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {  // a damaged file: said below
  }
  if (picture.empty() || (picture.depth() != CV_8U && picture.depth() != CV_16U))
    io::bad_file(file.name, "whole file", "no picture of 8 or 16 bit", "PNG, JPEG, BMP or TIFF");
  const auto copied = [&](auto out) {
    using Value = typename decltype(out.data)::value_type;
    for (int v = 0; v < picture.rows; ++v) std::copy_n(picture.ptr<Value>(v), picture.cols, out.row(v));
    return out;
  };
  if (picture.depth() == CV_8U) return copied(Image<std::uint8_t>(picture.cols, picture.rows));
  return to_8_bit(copied(Image<std::uint16_t>(picture.cols, picture.rows)));
}

}  // namespace tribin
