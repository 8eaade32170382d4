// OpenCV's RgbdNormals, FALS with a 7 x 7 window: the fastest peer for normals.

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/rgbd.hpp>

#include "peer_io.hpp"

int main(int argc, char** argv) {
  const peer::Request r = peer::read_request(argc, argv);
  cv::setNumThreads(1);
  const std::size_t pixels = static_cast<std::size_t>(r.width) * r.height;
  std::vector<float> cloud = peer::read_floats(r.cloud, 3 * pixels);
  const cv::Mat points(r.height, r.width, CV_32FC3, cloud.data());
  const cv::Mat k = (cv::Mat_<float>(3, 3) << r.fx, 0, r.cx, 0, r.fy, r.cy, 0, 0, 1);
  cv::rgbd::RgbdNormals estimator(r.height, r.width, CV_32F, k, 7, cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_FALS);
  estimator.initialize();
  cv::Mat normals;
  const peer::Stopwatch watch;
  estimator(points, normals);
  watch.report();
  std::vector<float> out(3 * pixels, 0.0f);
  for (int v = 0; v < r.height; ++v)
    for (int u = 0; u < r.width; ++u)
      for (int i = 0; i < 3; ++i) {
        const float x = normals.at<cv::Vec3f>(v, u)[i];
        out[3 * (static_cast<std::size_t>(v) * r.width + u) + i] = std::isfinite(x) ? x : 0;
      }
  peer::write_raw(r.out, out);
}
