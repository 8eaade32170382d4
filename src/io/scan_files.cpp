#include "tribin/io/scan_files.hpp"

#include "io/depth_image.hpp"
#include "io/png.hpp"

namespace tribin {

std::vector<std::string> scan_extensions() { return {".png"}; }

Scan read_scan(const std::filesystem::path& path, const ScanReadOptions& options) {
  const std::string extension = io::lower_extension(path);
  if (extension == ".png") {
    const io::FileBytes file = io::read_file(path);
    return io::scan_from_steps(file.name, io::decode_png16(file), io::camera_of_image(path, options));
  }
  io::bad_file(path.string(), "", "extension " + io::in_quotes(extension), "a scan (.png)");
}

}  // namespace tribin
