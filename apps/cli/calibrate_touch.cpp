#include <cstdio>
#include <ctime>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/hand_eye_file.hpp"
#include "tribin/report/calibration_json.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string points, date, json;
};

/// Today in UTC. Only here does a clock enter a result, and only where neither the option nor the file has the day.
std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm day{};
  gmtime_r(&now, &day);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &day);
  return text;
}

std::string date_of(const Options& options, const TouchFile& file) {
  if (options.date.empty()) return file.date.value_or(today());
  if (!is_date(options.date))
    throw Error(ErrorCode::bad_option, "--date: saw '" + options.date + "', wanted a day, YYYY-MM-DD");
  return options.date;
}

int run(const Options& options, const Context& context) {
  const TouchFile file = read_touch_file(options.points);
  const std::string date = date_of(options, file);
  TouchResult result;
  try {
    result = evaluate_touch(file.points);
  } catch (const Error& e) {  // the library does not know the file
    throw Error(e.code(), options.points + ": " + e.what());
  }
  for (const auto& [code, text] : touch_warnings(result)) log(LogLevel::warning, text);
  if (!options.json.empty()) write_text(options.json, touch_json(file, date, result));
  if (options.json != "-" && !context.quiet) {
    std::printf("%s: %zu points, rms %.3f mm, at most %.3f mm; after the best shift and turn %.3f mm\n", date.c_str(),
                file.points.size(), result.rms_mm, result.max_mm, result.residual_rms_mm);
    for (const TouchRegion& r : result.regions)
      std::printf("  x %.0f..%.0f, y %.0f..%.0f, z %.0f..%.0f mm: %zu points, rms %.3f mm, mean %.2f %.2f %.2f mm\n",
                  r.min_mm.x(), r.max_mm.x(), r.min_mm.y(), r.max_mm.y(), r.min_mm.z(), r.max_mm.z(), r.points.size(),
                  r.rms_mm, r.mean_error_mm.x(), r.mean_error_mm.y(), r.mean_error_mm.z());
  }
  return 0;
}

}  // namespace

void add_calibrate_touch(CLI::App& group, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(group, context, "touch", "Predicted against touched points: does the robot arrive?",
                                  "tribin calibrate touch points.json --json touch.json");
  command->add_option("POINTS.json", options->points, "Points as predicted and as touched (docs/calibration.md)")
      ->required();
  command->add_option("--date", options->date, "Day of the test, YYYY-MM-DD; else the file's, else today (UTC)")
      ->type_name("DAY");
  command->add_option("--json", options->json, "Result; - is stdout")->type_name("OUT");
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
