#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/report/bop_results.hpp"

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

/// Joins the files of one kind; nothing where not every shard has one.
bool merge_kind(const std::vector<std::string>& shards, const char* extension, const fs::path& out) {
  std::vector<std::vector<BopLine>> files;
  for (const std::string& shard : shards) {
    const fs::path file = fs::path(shard).replace_extension(extension);
    if (!fs::exists(file)) return false;
    files.push_back(read_bop_lines(file));
  }
  write_text(fs::path(out).replace_extension(extension).string(),
             merged_bop_lines(files, std::string(extension) == ".csv"));
  return true;
}

int run(const std::vector<std::string>& shards, const std::string& out) {
  for (const std::string& shard : shards)
    if (!fs::exists(shard))
      throw Error(ErrorCode::bad_input, shard + ": cannot be opened; wanted results of tribin bop");
  for (const std::string& name : {out, shards.front()})
    if (fs::path(name).extension() != ".csv" && fs::path(name).extension() != ".ndjson")
      throw Error(ErrorCode::bad_option, name + ": wanted a name that ends in .csv or .ndjson");
  const bool csv = merge_kind(shards, ".csv", out), records = merge_kind(shards, ".ndjson", out);
  if (!csv && !records)
    throw Error(ErrorCode::bad_input, "the shards have neither all a .csv nor all a .ndjson; wanted one kind of all");
  std::printf("%s: %zu shards joined%s\n", out.c_str(), shards.size(),
              csv && records ? ", .csv and .ndjson"
              : csv          ? ", .csv alone: an .ndjson is missing"
                             : ", .ndjson alone: a .csv is missing");
  return 0;
}

}  // namespace

void add_merge(CLI::App& app, Context& context) {
  auto shards = std::make_shared<std::vector<std::string>>();
  auto out = std::make_shared<std::string>();
  CLI::App* command = add_command(app, context, "merge", "Join the results of shards into those of one run",
                                  "tribin merge shard_*.csv -o results.csv");
  command->add_option("SHARD", *shards, "Results of tribin bop; .csv and .ndjson of the same name go together")
      ->required();
  command->add_option("-o", *out, "Where the joined results go")->required()->type_name("OUT");
  command->callback([shards, out, &context] { context.run = [shards, out] { return run(*shards, *out); }; });
}

}  // namespace tribin::cli
