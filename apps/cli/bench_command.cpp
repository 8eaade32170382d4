#include "commands.hpp"
#include "tribin/core/error.hpp"
namespace tribin::cli {
void add_bench(CLI::App&, Context&) {}
void add_simulate(CLI::App&, Context&) {}
}  // namespace tribin::cli
