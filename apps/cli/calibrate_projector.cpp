#include <algorithm>
#include <cstdio>

#include "calibrate_pictures.hpp"
#include "tribin/capture/projector_points.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/rig_file.hpp"
#ifdef TRIBIN_WITH_CALIBRATION
#include "tribin/calibration/find_board.hpp"
#endif

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

struct Options : CalibrationArguments {
  std::vector<std::string> stops;
  std::string list, projector_size, rig;
};

#ifdef TRIBIN_WITH_CALIBRATION

/// A folder of frames, or all folders of frames in it, by name.
std::vector<fs::path> stops_in(const fs::path& path, bool described_outside) {
  if (!fs::is_directory(path))
    throw Error(ErrorCode::bad_input, path.string() + ": saw no folder, wanted one with the frames of a board");
  const auto holds_frames = [&](const fs::path& folder) {
    return fs::exists(folder / "frames.json") || described_outside;
  };
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(path))
    if (entry.is_directory() && holds_frames(entry.path())) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  if (out.empty()) out.push_back(path);
  return out;
}

/// What the camera sees under full light: the white image of the set, else the mean of the fringes.
Image<std::uint8_t> lit_picture(const FrameStack& frames, const Decoded& decoded) {
  for (std::size_t i = 0; i < frames.patterns.size(); ++i) {
    if (frames.patterns[i].kind != PatternKind::white) continue;
    return frames.grey8.empty() ? to_8_bit(frames.grey16[i]) : frames.grey8[i];
  }
  return decoded.brightness;
}

BoardObserver& observer_of(RigCalibrationReport& report, const FrameStack& frames, const std::string& file) {
  for (BoardObserver& o : report.observers) {
    if (o.name != frames.camera) continue;
    if (o.width != frames.width() || o.height != frames.height())
      throw Error(ErrorCode::bad_input, file + ": saw " + std::to_string(frames.width()) + " x " +
                                            std::to_string(frames.height()) + " px of camera " + o.name + ", wanted " +
                                            std::to_string(o.width) + " x " + std::to_string(o.height) +
                                            " as at the other stops");
    return o;
  }
  report.observers.push_back({frames.camera, frames.width(), frames.height(), false, {}});
  return report.observers.back();
}

/// The projector's size by the option or the frames.
std::pair<int, int> projector_size(const Options& options, const FrameStack& frames, const std::string& file) {
  std::pair<int, int> size{frames.projector_width, frames.projector_height};
  if (!options.projector_size.empty()) {
    char cross = 0, rest = 0;
    if (std::sscanf(options.projector_size.c_str(), "%d%c%d%c", &size.first, &cross, &size.second, &rest) != 3 ||
        cross != 'x' || size.first < 8 || size.second < 8)
      throw Error(ErrorCode::bad_option,
                  "--projector-size " + options.projector_size + ": wanted WIDTHxHEIGHT in pixels, as 1280x800");
  }
  if (size.first == 0)
    throw Error(ErrorCode::bad_input, file +
                                          ": frames.json: saw no \"projector\" {width, height}, wanted it there or "
                                          "as --projector-size WIDTHxHEIGHT");
  return size;
}

RigCalibrationReport look(const Options& options) {
  RigCalibrationReport out;
  out.board = board_of(options);
  BoardObserver projector{"projector", 0, 0, true, {}};
  for (const std::string& argument : options.stops)
    for (const fs::path& stop : stops_in(argument, !options.list.empty())) {
      const std::vector<FrameStack> all = read_frames(stop, options.list);
      const auto size = projector_size(options, all[0], stop.string());
      if (projector.width != 0 && size != std::pair{projector.width, projector.height})
        throw Error(ErrorCode::bad_input, stop.string() + ": saw a projector of another size, wanted " +
                                              std::to_string(projector.width) + " x " +
                                              std::to_string(projector.height) + " as at the other stops");
      std::tie(projector.width, projector.height) = size;
      out.ids.push_back(stop.filename().empty() ? stop.parent_path().filename().string() : stop.filename().string());
      BoardSighting lit;
      for (const FrameStack& frames : all) {
        BoardObserver& camera = observer_of(out, frames, stop.string());
        camera.views.resize(out.ids.size());
        const Decoded decoded = decode(frames);
        for (const std::string& warning : decoded.warnings) log(LogLevel::warning, stop.string() + ": " + warning);
        const std::optional<BoardSighting> seen = find_board(lit_picture(frames, decoded), out.board);
        if (!seen) {
          out.not_found.push_back(stop.string() + (all.size() > 1 ? ", camera " + frames.camera : ""));
          continue;
        }
        camera.views.back() = *seen;
        // Any camera tells the projector's points; the one that tells most of them is taken.
        BoardSighting points = projector_points(*seen, decoded);
        if (points.point.size() > lit.point.size()) lit = std::move(points);
      }
      projector.views.push_back(std::move(lit));
    }
  for (BoardObserver& o : out.observers) o.views.resize(out.ids.size());
  out.observers.push_back(std::move(projector));
  return out;
}

/// The cameras of a rig that is calibrated already are held.
void hold_cameras(const std::string& file, RigCalibrationReport& report) {
  report.known = read_rig(file);
  for (BoardObserver& observer : report.observers) {
    if (observer.projector) continue;
    std::string names;
    for (const RigCamera& camera : report.known->cameras) {
      names += (names.empty() ? "" : ", ") + camera.name;
      if (camera.name == observer.name) observer.known = camera;
    }
    if (!observer.known)
      throw Error(ErrorCode::bad_input,
                  file + ": saw no camera " + observer.name + " (it has " + names + "), wanted those of the frames");
    const PinholeCamera& camera = observer.known->camera;
    if (camera.width != observer.width || camera.height != observer.height)
      throw Error(ErrorCode::bad_input, file + ": saw camera " + observer.name + " of " + std::to_string(camera.width) +
                                            " x " + std::to_string(camera.height) + " px, wanted " +
                                            std::to_string(observer.width) + " x " + std::to_string(observer.height) +
                                            " as its frames have");
  }
}

#endif

int run([[maybe_unused]] const Options& options, [[maybe_unused]] const Context& context) {
#ifdef TRIBIN_WITH_CALIBRATION
  RigCalibrationReport report = look(options);
  if (!options.rig.empty()) hold_cameras(options.rig, report);
  report.result = calibrate_rig(report.board, report.observers);
  return finish_calibration(options, report, context);
#else
  refuse_without_calibration();
#endif
}

}  // namespace

void add_calibrate_projector(CLI::App& group, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      group, context, "projector", "Projector and cameras at once, from the frames of a pattern set on a board",
      "tribin calibrate projector stops --size 9x6 --pitch-mm 20 -o rig.json\n"
      "  tribin calibrate projector stops --size 9x6 --pitch-mm 20 --rig cameras.json -o rig.json");
  command->add_option("STOPS", options->stops, "Folders of frames of the board, or one folder that holds them")
      ->required();
  command->add_option("--frames", options->list, "frames.json of folders that have none")->type_name("FILE");
  command
      ->add_option("--rig", options->rig, "Cameras that are calibrated already: they are held, the projector is added")
      ->type_name("FILE");
  command->add_option("--projector-size", options->projector_size, "Where frames.json does not say it [px]")
      ->type_name("WxH");
  add_calibration_arguments(command, *options);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
