#include <algorithm>
#include <iostream>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/report/eval_report.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string dataset, results, split = "test", targets, models = "models", json;
  bool list = false, done = false, in_view = false;
};

int run(const Options& options) {
  const std::filesystem::path models_dir = std::filesystem::path(options.dataset) / options.models;
  const std::vector<eval::Model> models = eval::read_bop_models(models_dir);
  const std::vector<eval::ImageResult> results = eval::read_results(options.results, models);
  std::vector<eval::ImageTruth> truths = eval::read_truths(options.dataset, options.split, options.targets, models_dir);
  if (options.done)
    std::erase_if(truths, [&](const eval::ImageTruth& image) {
      return std::none_of(results.begin(), results.end(),
                          [&](const eval::ImageResult& r) { return r.scene == image.scene && r.image == image.image; });
    });
  eval::Judged judged = eval::judge_results(truths, results, models);
  if (options.in_view) eval::mark_in_view(judged, truths, models, options.dataset, options.split, models_dir);
  if (!options.json.empty()) write_text(options.json, eval_json(judged));
  if (options.json != "-") std::cout << eval_text(judged, options.list);
  return 0;
}

}  // namespace

void add_eval(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "eval", "Judge results on a BOP data set: recall, false ones, errors",
                                  "tribin eval scenes results.ndjson --list");
  command->add_option("DATASET", options->dataset, "Folder of a data set in BOP layout, with truth")->required();
  command->add_option("RESULTS", options->results, "BOP's CSV; or NDJSON, which tells confidence too")->required();
  command->add_option("--split", options->split, "Folder of its scenes")->type_name("NAME");
  command->add_option("--targets", options->targets, "Judge the images that it names only; default: all of the split")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  command->add_option("--models", options->models, "Folder of its models")->type_name("NAME");
  command->add_option("--json", options->json, "Write the figures as JSON; - is stdout")->type_name("OUT|-");
  command->add_flag("--list", options->list, "Name each missed part and each false answer");
  command->add_flag("--in-view", options->in_view,
                    "Tell parts apart whose telling feature the scan shows: all others cannot be known");
  command->add_flag("--done", options->done, "Leave out images without a result instead of counting them as missed");
  command->callback([options, &context] { context.run = [options] { return run(*options); }; });
}

}  // namespace tribin::cli
