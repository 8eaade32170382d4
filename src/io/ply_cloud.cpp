#include "io/ply.hpp"
#include "io/raw_cloud.hpp"

namespace tribin::io {

RawCloud parse_ply_cloud(const FileBytes& file) {
  PlyContent content = parse_ply(file);
  if (content.points.empty()) bad_file(file.name, "header", "no points", "points", ErrorCode::too_little_data);
  RawCloud cloud{.name = file.name,
                 .width = content.width,
                 .height = content.height,
                 .points = {},
                 .viewpoint = {},
                 .taken = {},
                 .warnings = {}};
  if (content.width == 0) {
    cloud.width = static_cast<int>(content.points.size());
    cloud.height = 1;
  }
  cloud.points = std::move(content.points);
  return cloud;
}

}  // namespace tribin::io
