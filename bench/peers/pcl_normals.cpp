// PCL's integral-image normals (AVERAGE_3D_GRADIENT, smoothing 20): its fast estimator for organized clouds.

#include <pcl/features/integral_image_normal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>

#include "peer_io.hpp"

int main(int argc, char** argv) {
  const peer::Request r = peer::read_request(argc, argv);
  const std::size_t pixels = static_cast<std::size_t>(r.width) * r.height;
  const std::vector<float> raw = peer::read_floats(r.cloud, 3 * pixels);
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>(r.width, r.height));
  cloud->is_dense = false;
  // In metres: PCL's depth-change factor is a length in the cloud's unit, and its examples are in metres.
  for (std::size_t i = 0; i < pixels; ++i)
    (*cloud)[i] = pcl::PointXYZ(raw[3 * i] / 1000, raw[3 * i + 1] / 1000, raw[3 * i + 2] / 1000);
  pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimator;
  estimator.setNormalEstimationMethod(estimator.AVERAGE_3D_GRADIENT);
  estimator.setMaxDepthChangeFactor(0.02f);
  estimator.setNormalSmoothingSize(20.0f);
  pcl::PointCloud<pcl::Normal> normals;
  const peer::Stopwatch watch;
  estimator.setInputCloud(cloud);
  estimator.compute(normals);
  watch.report();
  std::vector<float> out(3 * pixels, 0.0f);
  for (std::size_t i = 0; i < pixels; ++i)
    for (int k = 0; k < 3; ++k)
      if (const float x = normals[i].normal[k]; std::isfinite(x)) out[3 * i + static_cast<std::size_t>(k)] = x;
  peer::write_raw(r.out, out);
}
