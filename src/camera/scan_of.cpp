#include <algorithm>
#include <chrono>

#include "tribin/camera/camera.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

/// The frames of each rig camera, by name; by order where the rig has no such name.
std::vector<FrameStack> in_order_of(const Rig& rig, std::vector<FrameStack> frames) {
  std::vector<FrameStack> out;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const std::string& name = rig.cameras[i].name;
    auto found = std::find_if(frames.begin(), frames.end(), [&](const FrameStack& f) { return f.camera == name; });
    if (found == frames.end() && name.empty() && i < frames.size())
      found = frames.begin() + static_cast<std::ptrdiff_t>(i);
    if (found == frames.end())
      throw Error(ErrorCode::bad_input, rig.source + ": camera " + name + ": saw no frames of it, wanted a camera \"" +
                                            name + "\" in frames.json (it has " + frames[0].camera +
                                            (frames.size() > 1 ? ", ..)" : ")"));
    out.push_back(*found);
  }
  return out;
}

ShotScan scan_of_frames(std::vector<FrameStack> frames, const std::optional<Rig>& rig, const DecodeOptions& options) {
  if (!rig)
    throw Error(ErrorCode::bad_option,
                "--calibration is missing: saw frames, wanted the rig.json that measures with them");
  if (rig->cameras.size() > 2)
    throw Error(ErrorCode::bad_input, rig->source + ": cameras: saw " + std::to_string(rig->cameras.size()) +
                                          ", wanted one with a projector, or two");
  ShotScan out;
  for (const FrameStack& f : in_order_of(*rig, std::move(frames))) out.decoded.push_back(decode(f, options));
  out.result =
      out.decoded.size() == 2 ? triangulate(*rig, out.decoded[0], out.decoded[1]) : triangulate(*rig, out.decoded[0]);
  return out;
}

}  // namespace

ShotScan scan_of(Shot shot, const std::optional<Rig>& rig, const DecodeOptions& options) {
  ShotScan out;
  if (auto* scan = std::get_if<Scan>(&shot.content))
    out.result.scan = std::move(*scan);
  else
    out = scan_of_frames(std::move(std::get<std::vector<FrameStack>>(shot.content)), rig ? rig : shot.rig, options);
  Scan& scan = out.result.scan;
  scan.taken = shot.taken;
  scan.warnings.insert(scan.warnings.begin(), shot.warnings.begin(), shot.warnings.end());
  return out;
}

std::int64_t now_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

}  // namespace tribin
