// The command line: reads options, runs one command, turns errors into one sentence and an exit code.

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/core/parallel.hpp"
#ifdef TRIBIN_WITH_CAD_EXCHANGE
#include "tribin/cad_exchange/read_step.hpp"
#endif

namespace {

using tribin::cli::Context;

/// The chosen command, for the head of messages: "tribin locate".
std::string name_of_command(const CLI::App& app) {
  std::string name = "tribin";
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) name += " " + (at = at->get_subcommands().front())->get_name();
  return name;
}

void log_to_stderr(const Context& context) {
  tribin::set_log_sink([&context](tribin::LogLevel level, const std::string& message) {
    if (level == tribin::LogLevel::warning && !context.quiet) std::cerr << "warning: " << message << "\n";
    if (level != tribin::LogLevel::warning && context.verbose) std::cerr << message << "\n";
  });
}

void register_optional_readers() {
#ifdef TRIBIN_WITH_CAD_EXCHANGE
  tribin::register_cad_exchange();
#endif
}

int fail(const CLI::App& app, const std::string& message, int code) {
  std::cerr << name_of_command(app) << ": " << message << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  tribin::cli::clean_up_on_signal();
  Context context;
  context.command.assign(argv, argv + argc);

  CLI::App app("tribin finds CAD parts in 3-D scans: class and 6-DOF pose, with the evidence.", "tribin");
  app.set_version_flag("--version", "tribin " TRIBIN_VERSION);
  app.require_subcommand(1);
  app.footer("tribin COMMAND --help shows each command's options and an example.");
  tribin::cli::add_locate(app, context);
  tribin::cli::add_segment(app, context);
  tribin::cli::add_normals(app, context);
  tribin::cli::add_part(app, context);
  tribin::cli::add_convert(app, context);
  tribin::cli::add_patterns(app, context);
  tribin::cli::add_scan(app, context);
  tribin::cli::add_simulate(app, context);
  tribin::cli::add_robot_server(app, context);
  tribin::cli::add_grasps(app, context);
  tribin::cli::add_pick(app, context);
  tribin::cli::add_simulate_controller(app, context);
  tribin::cli::add_calibrate(app, context);
  tribin::cli::add_bop(app, context);
  tribin::cli::add_merge(app, context);
  tribin::cli::add_eval(app, context);
  tribin::cli::add_bench(app, context);

  constexpr int kBadOption = static_cast<int>(tribin::ErrorCode::bad_option);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    return fail(app, std::string(e.what()) + " (--help shows what there is)", kBadOption);
  }
  log_to_stderr(context);
  tribin::set_thread_count(context.threads);
  register_optional_readers();
  try {
    return context.run();
  } catch (const tribin::Error& e) {
    return fail(app, e.what(), static_cast<int>(e.code()));
  } catch (const std::bad_alloc&) {
    return fail(app, "out of memory", static_cast<int>(tribin::ErrorCode::internal));
  } catch (const std::exception& e) {
    return fail(app, std::string("internal error: ") + e.what(), static_cast<int>(tribin::ErrorCode::internal));
  }
}
