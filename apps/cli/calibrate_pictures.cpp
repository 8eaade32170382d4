#include "calibrate_pictures.hpp"

#include <algorithm>
#include <cstdio>
#include <map>

#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/io/rig_file.hpp"
#ifdef TRIBIN_WITH_CALIBRATION
#include "tribin/calibration/find_board.hpp"
#endif

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

struct Options : CalibrationArguments {
  std::vector<std::string> pictures;
};

/// The pictures of one camera.
struct Source {
  std::string name;
  std::vector<fs::path> files;
};

bool is_picture(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* known : {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"})
    if (extension == known) return true;
  return false;
}

/// The pictures of a folder by name, or the file itself.
std::vector<fs::path> pictures_in(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(path))
    if (entry.is_regular_file() && is_picture(entry.path())) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  if (out.empty())
    throw Error(ErrorCode::bad_input, path.string() + ": saw no picture in this folder, wanted some of a board");
  return out;
}

#ifdef TRIBIN_WITH_CALIBRATION

/// The last number in a file's name: left12.jpg and right12.jpg show one view.
std::string number_in(const fs::path& file) {
  const std::string stem = file.stem().string();
  const std::size_t end = stem.find_last_of("0123456789");
  if (end == std::string::npos) return "";
  const std::size_t before = stem.find_last_not_of("0123456789", end);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  const std::size_t digit = std::min(stem.find_first_not_of('0', begin), end);
  return stem.substr(digit, end + 1 - digit);
}

/// What pairs pictures of several cameras: their names, or the last number in them where the names differ.
std::string (*key_for(const std::vector<Source>& sources))(const fs::path&) {
  const auto by_stem = +[](const fs::path& file) { return file.stem().string(); };
  if (sources.size() == 1) return by_stem;
  std::map<std::string, std::size_t> count;
  for (const Source& s : sources)
    for (const fs::path& f : s.files) ++count[f.stem().string()];
  const bool all_lone = std::all_of(count.begin(), count.end(), [](const auto& c) { return c.second == 1; });
  return all_lone ? +[](const fs::path& file) { return number_in(file); } : by_stem;
}

/// Finds the board in all pictures. \throws Error where pictures of one camera differ in size, or none shows the board.
RigCalibrationReport look(const Board& board, const std::vector<Source>& sources) {
  RigCalibrationReport out;
  out.board = board;
  const auto key = key_for(sources);
  std::map<std::string, std::size_t> view_of;  // in the order of the first camera, then of the others
  for (const Source& s : sources)
    for (const fs::path& f : s.files)
      if (view_of.emplace(key(f), out.ids.size()).second) out.ids.push_back(key(f));
  for (const Source& s : sources) {
    BoardObserver observer{s.name, 0, 0, false, std::vector<BoardSighting>(out.ids.size())};
    std::vector<std::optional<BoardSighting>> found(s.files.size());
    std::vector<std::pair<int, int>> size(s.files.size());
    parallel_each(static_cast<int>(s.files.size()), [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      const Image<std::uint8_t> picture = read_picture(s.files[k]);
      size[k] = {picture.width, picture.height};
      found[k] = find_board(picture, board);
    });
    std::map<std::string, fs::path> taken;
    int seen = 0;
    for (std::size_t k = 0; k < s.files.size(); ++k) {
      if (size[k] != size[0])
        throw Error(ErrorCode::bad_input, s.files[k].string() + ": saw " + std::to_string(size[k].first) + " x " +
                                              std::to_string(size[k].second) + " px, wanted " +
                                              std::to_string(size[0].first) + " x " + std::to_string(size[0].second) +
                                              " as " + s.files[0].string());
      const auto [first, fresh] = taken.emplace(key(s.files[k]), s.files[k]);
      if (!fresh)
        throw Error(ErrorCode::bad_input, s.files[k].string() + ": saw the view '" + key(s.files[k]) + "' again (" +
                                              first->second.string() + "), wanted one picture a view");
      if (!found[k]) {
        out.not_found.push_back(s.files[k].string());
        continue;
      }
      ++seen;
      observer.views[view_of[key(s.files[k])]] = *found[k];
    }
    if (seen == 0) {
      std::string other;
      if (board.kind == BoardKind::chessboard)
        if (const auto shown = chessboard_size(read_picture(s.files[0])))
          other = " (" + s.files[0].string() + " shows one of " + std::to_string(shown->first) + " x " +
                  std::to_string(shown->second) + " inner corners)";
      throw Error(ErrorCode::too_little_data, "camera " + s.name + ": saw no " + describe(board) + " in any of " +
                                                  std::to_string(s.files.size()) + " pictures" + other +
                                                  ", wanted one in " + std::to_string(kFewestViews) + " or more");
    }
    observer.width = size[0].first, observer.height = size[0].second;
    out.observers.push_back(std::move(observer));
  }
  return out;
}

#endif

int calibrate([[maybe_unused]] const Options& options, [[maybe_unused]] const std::vector<Source>& sources,
              [[maybe_unused]] const Context& context) {
#ifdef TRIBIN_WITH_CALIBRATION
  RigCalibrationReport report = look(board_of(options), sources);
  report.result = calibrate_rig(report.board, report.observers);
  return finish_calibration(options, report, context);
#else
  refuse_without_calibration();
#endif
}

int run_camera(const Options& options, const Context& context) {
  Source source;
  source.name = "camera";
  for (const std::string& p : options.pictures)
    for (const fs::path& f : pictures_in(p)) source.files.push_back(f);
  return calibrate(options, {source}, context);
}

int run_rig(const Options& options, const Context& context) {
  std::vector<Source> sources;
  for (const std::string& p : options.pictures) {
    const std::size_t sign = p.find('=');
    if (sign == std::string::npos || sign == 0)
      throw Error(ErrorCode::bad_option, "saw '" + p + "', wanted NAME=FOLDER, as left=boards/left");
    sources.push_back({p.substr(0, sign), pictures_in(p.substr(sign + 1))});
    for (std::size_t i = 0; i + 1 < sources.size(); ++i)
      if (sources[i].name == sources.back().name)
        throw Error(ErrorCode::bad_option, "saw two cameras '" + sources[i].name + "', wanted a name for each");
  }
  if (sources.size() < 2)
    throw Error(ErrorCode::bad_option, "saw one camera, wanted two or more (one alone: tribin calibrate camera)");
  return calibrate(options, sources, context);
}

}  // namespace

void refuse_without_calibration() {
  throw Error(ErrorCode::bad_option,
              "calibration from pictures is not built in: install libopencv-dev and build again");
}

void add_calibration_arguments(CLI::App* command, CalibrationArguments& arguments) {
  command->add_option("--board", arguments.kind, "chessboard, circles, asymmetric_circles, charuco")
      ->check(CLI::IsMember({"chessboard", "circles", "asymmetric_circles", "charuco"}))
      ->type_name("KIND");
  command->add_option("--size", arguments.size, "Columns and rows: inner corners, circles; of charuco squares")
      ->required()
      ->type_name("CxR");
  command->add_option("--pitch-mm", arguments.pitch_mm, "Side of a square; distance of circles in a row")
      ->required()
      ->type_name("L");
  command->add_option("--marker-mm", arguments.marker_mm, "charuco: side of a marker")->type_name("L");
  command->add_option("--dictionary", arguments.dictionary, "charuco: OpenCV's name, as 4X4_50")->type_name("NAME");
  command->add_option("-o", arguments.out, "rig.json to write")->required()->type_name("FILE");
  command->add_option("--json", arguments.json, "Result with errors of each view; - is stdout")->type_name("OUT");
  command->add_option("--report", arguments.report, "Folder for a page with the pictures' points and residuals")
      ->type_name("DIR");
}

Board board_of(const CalibrationArguments& arguments) {
  Board board;
  const std::map<std::string, BoardKind> kinds{{"chessboard", BoardKind::chessboard},
                                               {"circles", BoardKind::circles},
                                               {"asymmetric_circles", BoardKind::asymmetric_circles},
                                               {"charuco", BoardKind::charuco}};
  board.kind = kinds.at(arguments.kind);
  char cross = 0, rest = 0;
  if (std::sscanf(arguments.size.c_str(), "%d%c%d%c", &board.columns, &cross, &board.rows, &rest) != 3 || cross != 'x')
    throw Error(ErrorCode::bad_option, "--size " + arguments.size + ": wanted COLUMNSxROWS, as 9x6");
  board.pitch_mm = arguments.pitch_mm;
  board.marker_mm = arguments.marker_mm;
  board.dictionary = arguments.dictionary;
  validate(board);
  return board;
}

int finish_calibration(const CalibrationArguments& arguments, const RigCalibrationReport& report,
                       const Context& context) {
  for (const auto& [code, text] : rig_calibration_warnings(report)) log(LogLevel::warning, text);
  StagedOutput staged(arguments.out);
  write_rig(staged.path(), rig_of(report));
  staged.publish();
  if (!arguments.json.empty()) write_text(arguments.json, rig_calibration_json(report));
  if (!arguments.report.empty()) {
    StagedOutput folder(arguments.report);
    write_rig_calibration_report(folder.path(), report);
    folder.publish();
  }
  if (arguments.json == "-" || context.quiet) return 0;
  std::size_t used = 0;
  for (const BoardView& v : report.result.views) used += v.used;
  std::printf("%s: %zu of %zu views, rms %.3f px\n", arguments.out.c_str(), used, report.ids.size(),
              report.result.rms_px);
  for (std::size_t i = 0; i < report.observers.size(); ++i) {
    const ObserverCalibration& o = report.result.observers[i];
    std::printf("  %s: fx %.2f +- %.2f, fy %.2f, cx %.2f +- %.2f, cy %.2f px; rms %.3f px of %d points\n",
                o.camera.name.c_str(), o.camera.camera.fx, std::sqrt(o.covariance(0, 0)), o.camera.camera.fy,
                o.camera.camera.cx, std::sqrt(o.covariance(2, 2)), o.camera.camera.cy, o.rms_px, o.points);
    if (i == 0) continue;
    std::printf("    %.3f mm from %s, +- %.3f mm, %.4f deg\n", o.camera.rig_from_camera.translation().norm(),
                report.observers[0].name.c_str(), std::sqrt(o.pose_covariance.topLeftCorner<3, 3>().trace()),
                std::sqrt(o.pose_covariance.bottomRightCorner<3, 3>().trace()) / kDegree);
  }
  return 0;
}

void add_calibrate_camera(CLI::App& group, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(group, context, "camera", "Lens of one camera, from pictures of a board",
                  "tribin calibrate camera boards --size 9x6 --pitch-mm 20 -o rig.json --json calibration.json");
  command->add_option("PICTURES", options->pictures, "Folders or files")->required();
  add_calibration_arguments(command, *options);
  command->callback(
      [options, &context] { context.run = [options, &context] { return run_camera(*options, context); }; });
}

void add_calibrate_rig(CLI::App& group, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(group, context, "rig",
                  "Lenses and places of two cameras or more, from pictures of a board that they took together",
                  "tribin calibrate rig left=boards/left right=boards/right --size 9x6 --pitch-mm 20 -o rig.json");
  command->add_option("NAME=FOLDER", options->pictures, "Pictures of each camera; equal names or numbers are one view")
      ->required();
  add_calibration_arguments(command, *options);
  command->callback([options, &context] { context.run = [options, &context] { return run_rig(*options, context); }; });
}

}  // namespace tribin::cli
