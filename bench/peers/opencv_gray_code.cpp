// OpenCV's GrayCodePattern on its own pattern set. Gets where each pixel looks on the projector (float32 column, row a
// pixel, NaN = dark) in place of a cloud, and in place of fx fy cx cy the projector's width and height, the modulation
// and the noise [grey levels]; writes the column of each pixel (int32, -1 = none). Two times: "ms" of getProjPixel at
// each pixel, "decode_ms" of decode(), which wants two cameras and makes their disparities too, halved.

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/structured_light.hpp>
#include <random>

#include "peer_io.hpp"

int main(int argc, char** argv) {
  const peer::Request r = peer::read_request(argc, argv);
  cv::setNumThreads(1);
  const std::size_t pixels = static_cast<std::size_t>(r.width) * r.height;
  const std::vector<float> looks = peer::read_floats(r.cloud, 2 * pixels);
  const auto code = cv::structured_light::GrayCodePattern::create(static_cast<int>(r.fx), static_cast<int>(r.fy));
  std::vector<cv::Mat> patterns;
  code->generate(patterns);
  cv::Mat black, white;
  code->getImagesForShadowMasks(black, white);
  patterns.push_back(black);
  patterns.push_back(white);
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, r.cy);
  const float ambient = 20;
  std::vector<cv::Mat> frames;
  for (const cv::Mat& pattern : patterns) {
    cv::Mat frame(r.height, r.width, CV_8UC1);
    for (std::size_t i = 0; i < pixels; ++i) {
      const float x = looks[2 * i], y = looks[2 * i + 1];
      float light = ambient / 4;
      if (std::isfinite(x))
        light = ambient + 2 * r.cx * (pattern.at<unsigned char>(std::lround(y), std::lround(x)) > 127 ? 1 : 0);
      frame.data[i] = static_cast<unsigned char>(std::clamp(std::lround(light + normal(random)), 0L, 255L));
    }
    frames.push_back(frame);
  }
  const cv::Mat dark = frames[frames.size() - 2], lit = frames.back();
  frames.resize(frames.size() - 2);
  std::vector<int> columns(pixels, -1);
  const peer::Stopwatch watch;
  for (int v = 0; v < r.height; ++v)
    for (int u = 0; u < r.width; ++u) {
      if (lit.at<unsigned char>(v, u) - dark.at<unsigned char>(v, u) < 40) continue;  // its own default for shadows
      cv::Point at;
      if (!code->getProjPixel(frames, u, v, at)) columns[static_cast<std::size_t>(v) * r.width + u] = at.x;
    }
  const double each = watch.ms();
  const std::vector<std::vector<cv::Mat>> cameras{frames, frames};
  cv::Mat disparity;
  const peer::Stopwatch whole;
  code->decode(cameras, disparity, std::vector<cv::Mat>{dark, dark}, std::vector<cv::Mat>{lit, lit},
               cv::structured_light::DECODE_3D_UNDERWORLD);
  std::printf("{\"ms\": %.3f, \"decode_ms\": %.3f}\n", each, whole.ms() / 2);
  peer::write_raw(r.out, columns);
}
