#pragma once

#include <map>
#include <string>

#include "io/depth_image.hpp"
#include "io/mesh_formats.hpp"
#include "io/png.hpp"
#include "io/raw_cloud.hpp"
#include "tribin/cad/mend.hpp"

namespace tribin::test {

inline void use_cloud(io::RawCloud cloud) {
  const ScanReadOptions options;
  if (cloud.organized()) {
    io::scan_from_cloud(std::move(cloud), options);
  } else {
    io::points_from_cloud(cloud, options);
  }
}

inline void use_array(const io::FileBytes& file, io::RawArray array) {
  if (array.channels == 3) return use_cloud(io::cloud_from_array(file, std::move(array)));
  CameraFile camera;
  camera.camera = {0, 0, 100, 100, 50, 50};
  Image<float> depth;
  depth.width = array.width;
  depth.height = array.height;
  depth.data = std::move(array.values);
  io::scan_from_floats(file.name, std::move(depth), camera, LengthUnit::automatic);
}

/// Reads bytes as a family of files, to the end of what the readers do, and throws what they throw: for tests that feed
/// spoilt files and for the fuzzers. Families: pcd ply npy tif xyz png stl obj ply_mesh dxf.
inline void parse_any(const std::string& family, const io::FileBytes& file) {
  bool unit_known = false;
  Mesh mesh;
  if (family == "pcd") return use_cloud(io::parse_pcd(file));
  if (family == "ply") return use_cloud(io::parse_ply_cloud(file));
  if (family == "xyz") return use_cloud(io::parse_xyz(file));
  if (family == "npy") return use_array(file, io::parse_npy(file));
  if (family == "tif") return use_array(file, io::parse_tiff(file));
  if (family == "png") {
    CameraFile camera;
    camera.camera = {0, 0, 100, 100, 50, 50};
    io::scan_from_steps(file.name, io::decode_png16(file), camera);
    return;
  }
  if (family == "stl")
    mesh = io::parse_stl(file);
  else if (family == "obj")
    mesh = io::parse_obj(file);
  else if (family == "ply_mesh")
    mesh = io::parse_ply_mesh(file);
  else if (family == "dxf")
    mesh = io::parse_dxf(file, unit_known);
  else
    TRIBIN_ASSERT(!"a known family");
  mend_mesh(mesh);
}

}  // namespace tribin::test
