#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/core/content_hash.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/part_cache.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/report/bop_results.hpp"

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string dataset, split = "test", targets, models = "models", shard, out, bin, method = "surfel";
  int time_limit_ms = 0;
  bool no_times = false, no_cache = false;
};

/// Which of how many pieces of the work.
struct Shard {
  int index = 0;
  int count = 1;
};

/// "i/N"; 0/N is N/N, so that arrays that count from 0 and from 1 both do all of the work.
Shard shard_named(const std::string& text) {
  if (text.empty()) return {};
  Shard shard;
  int end = 0;
  if (std::sscanf(text.c_str(), "%d/%d%n", &shard.index, &shard.count, &end) != 2 ||
      end != static_cast<int>(text.size()) || shard.count < 1 || shard.index < 0 || shard.index > shard.count)
    throw Error(ErrorCode::bad_option, "--shard is " + text + "; wanted i/N with i in 0..N (0/N is N/N)");
  shard.index %= shard.count;
  return shard;
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The finished images of a run: one file each, so that a run that was broken off goes on.
class FinishedImages {
 public:
  /// \param recipe  what the results depend on; a folder of another recipe is refused.
  FinishedImages(const fs::path& results, const std::string& recipe) : folder_(results) {
    folder_.replace_extension(".images");
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) throw Error(ErrorCode::bad_option, folder_.string() + ": cannot be made: " + error.message());
    const fs::path run = folder_ / "run.json";
    if (!fs::exists(run))
      write_text(run.string(), recipe);
    else if (bytes_of(run) != recipe)
      throw Error(ErrorCode::bad_option, folder_.string() +
                                             " holds images of a run with other parts, options or program; remove it "
                                             "or give another -o");
  }
  fs::path file(const eval::BopTask& task) const {
    char name[40];
    std::snprintf(name, sizeof name, "%06d_%06d.ndjson", task.scene, task.image);
    return folder_ / name;
  }

 private:
  fs::path folder_;
};

/// All that results depend on beside the image: the parts' bytes, the options, the program itself.
std::string recipe_of(const Options& options, const std::vector<eval::BopObject>& objects) {
  nlohmann::ordered_json recipe = {
      {"tribin", TRIBIN_VERSION},
      {"program", hex_of(content_hash(bytes_of("/proc/self/exe")))},
      {"split", options.split},
      {"method", options.method},
      {"time_limit_ms", options.time_limit_ms},
      {"bin", options.bin.empty() ? "" : hex_of(content_hash(bytes_of(options.bin)))},
      {"times", !options.no_times},
      {"targets", options.targets.empty() ? "" : hex_of(content_hash(bytes_of(options.targets)))}};
  const fs::path infos = fs::path(options.dataset) / options.models / "models_info.json";
  if (fs::exists(infos)) recipe["models_info"] = hex_of(content_hash(bytes_of(infos)));
  for (const eval::BopObject& object : objects)
    recipe["objects"].push_back(
        {{"obj_id", object.id}, {"part", object.name}, {"hash", hex_of(content_hash(bytes_of(object.file)))}});
  return recipe.dump(1) + "\n";
}

/// The parts that a task offers; neighbouring images mostly want the same ones, so that the last set is kept.
class OfferedParts {
 public:
  OfferedParts(std::vector<eval::BopObject> objects, bool no_cache) : objects_(std::move(objects)) {
    if (!no_cache) cache_ = part_cache_folder();
  }
  std::span<const Part> of(const eval::BopTask& task) {
    if (task.objects == ids_ && !parts_.empty()) return parts_;
    std::vector<Part> parts;
    for (const eval::BopObject& object : objects_) {
      if (!std::binary_search(task.objects.begin(), task.objects.end(), object.id)) continue;
      const auto known =
          std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return p.name == object.name; });
      parts.push_back(known != parts_.end() ? *known : compiled(object));
    }
    parts_ = std::move(parts);
    ids_ = task.objects;
    return parts_;
  }

 private:
  Part compiled(const eval::BopObject& object) const {
    PartReadOptions options;
    options.name = object.name;
    options.cache = cache_;
    Part part = read_part(object.file, options);
    declare_symmetry(part, object.symmetry);
    return part;
  }

  std::vector<eval::BopObject> objects_;
  fs::path cache_;
  std::vector<int> ids_;
  std::vector<Part> parts_;
};

/// One image through the chain. A scan with too little in it, or too small for a part, is an answer without instances.
std::string record_of(const eval::BopTask& task, const std::vector<eval::BopObject>& objects, OfferedParts& offered,
                      const Options& options) {
  FinderOptions finder;
  finder.method = options.method == "paper" ? Method::paper : Method::surfel;
  finder.time_limit_ms = options.time_limit_ms;
  Scan scan;
  scan.source = task.depth.string();
  Found found;
  try {
    scan = read_scan(task.depth, {.camera_file = task.camera, .image_id = task.image});
    if (!options.bin.empty()) finder.bin = known_bin(read_bin(options.bin), scan);
    found = find_parts(scan, offered.of(task), finder);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::too_little_data && e.code() != ErrorCode::out_of_range) throw;
    log(LogLevel::warning,
        "scene " + std::to_string(task.scene) + ", image " + std::to_string(task.image) + ": " + e.what());
    found = Found();
    found.status = "no_data";
    found.warnings.push_back({"failed", e.what()});
  }
  return bop_record(task, objects, scan, found, {.times = !options.no_times});
}

int run(const Options& options, const Context& context) {
  const Shard shard = shard_named(options.shard);
  const fs::path out = options.out;
  if (out.extension() != ".csv" && out.extension() != ".ndjson")
    throw Error(ErrorCode::bad_option, "-o is " + options.out + "; wanted a name that ends in .csv or .ndjson");
  const std::vector<eval::BopObject> objects = eval::list_bop_objects(fs::path(options.dataset) / options.models);
  std::vector<eval::BopTask> tasks = eval::list_bop_tasks(options.dataset, options.split, options.targets, objects);
  std::erase_if(tasks, [&](const eval::BopTask& task) {
    return eval::shard_of(task.scene, task.image, shard.count) != shard.index;
  });
  const FinishedImages finished(out, recipe_of(options, objects));
  OfferedParts offered(objects, options.no_cache);
  std::vector<BopLine> records, rows;
  {
    Progress progress("Looking for parts", static_cast<int>(tasks.size()), context.quiet);
    for (const eval::BopTask& task : tasks) {
      const fs::path file = finished.file(task);
      if (!fs::exists(file)) write_text(file.string(), record_of(task, objects, offered, options));
      records.push_back({task.scene, task.image, bytes_of(file)});
      const std::vector<BopLine> own = bop_csv_rows(records.back().text, file.string(), 1);
      rows.insert(rows.end(), own.begin(), own.end());
      progress.done(static_cast<int>(records.size()));
    }
  }
  write_text(fs::path(out).replace_extension(".ndjson").string(), merged_bop_lines({records}, /*csv=*/false));
  write_text(fs::path(out).replace_extension(".csv").string(), merged_bop_lines({rows}, /*csv=*/true));
  std::printf("%s: %zu instances in %zu images\n", options.out.c_str(), rows.size(), records.size());
  return 0;
}

}  // namespace

void add_bop(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      app, context, "bop", "Look for the parts of a BOP data set in each of its images",
      "tribin bop tless --split test_primesense --models models_cad --targets tless/test_targets_bop19.json "
      "--shard 3/16 -o shard_3.csv");
  command->add_option("DATASET", options->dataset, "Folder of a data set in BOP layout")->required();
  command->add_option("--split", options->split, "Folder of its scenes")->type_name("NAME");
  command
      ->add_option("--targets", options->targets,
                   "Images and the parts to offer in each, as test_targets_bop19.json; default: all images, with "
                   "the parts of scene_parts.json or all")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  command->add_option("--models", options->models, "Folder of its models")->type_name("NAME");
  command->add_option("--shard", options->shard, "Only this piece of the images, i of N; tribin merge joins them")
      ->type_name("i/N");
  command->add_option("-o", options->out, "Result CSV of BOP; the full results go beside it as .ndjson")
      ->required()
      ->type_name("FILE");
  command->add_option("--method", options->method, "surfel or paper")
      ->check(CLI::IsMember({"surfel", "paper"}))
      ->type_name("M");
  command->add_option("--bin", options->bin, "As of locate, for each image")
      ->check(CLI::ExistingFile)
      ->type_name("BIN.toml");
  command->add_option("--time-limit-ms", options->time_limit_ms, "As of locate, for each image")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command->add_flag("--no-times", options->no_times, "Leave the times out: same input, same bytes");
  add_no_cache(command, options->no_cache);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
