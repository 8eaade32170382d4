// The training clouds of Fit4CAD at default options: Dice and types against the exact primitives, clean and noisy.
// usage: campaign_fit4cad [-v] [MODEL ...]     (all models of the archive where none is named; -v lists what is missed)
// Rule: for each true primitive the predicted one with most common points; Dice = 2 common / (true + predicted); mean
// over a model's primitives, then over models; a type counts when that predicted one has it.

#include "support/fit4cad.hpp"

#include <cstdio>
#include <cstring>

#include "tribin/core/error.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace {

using namespace tribin;
namespace fit4cad = tribin::test::fit4cad;

void print_misses(const fit4cad::Model& model, const fit4cad::Score& score) {
  for (std::size_t k = 0; k < model.primitives.size(); ++k) {
    const fit4cad::Match& m = score.matches[k];
    if (m.dice > 0.9 && m.type_right) continue;
    std::printf("    %-9s %-30s %5zu points: Dice %.2f, %s of %d points\n", model.primitives[k].type.c_str(),
                model.primitives[k].parameters.c_str(), model.primitives[k].points.size(), m.dice, m.got.c_str(),
                m.got_points);
  }
}

struct Total {
  double dice = 0;
  int models = 0, types = 0, primitives = 0;
};

void add(Total& total, const fit4cad::Score& score, std::size_t primitives) {
  total.dice += score.dice;
  ++total.models;
  total.types += score.types_right;
  total.primitives += static_cast<int>(primitives);
}

void print(const char* name, const Total& t) {
  std::printf("%s: Dice %.4f a model, types right %d of %d = %.4f\n", name, t.dice / t.models, t.types, t.primitives,
              static_cast<double>(t.types) / t.primitives);
}

int run(bool verbose, const std::vector<int>& wanted) {
  Total clean, noisy;
  for (int number : wanted.empty() ? fit4cad::model_numbers() : wanted) {
    const std::optional<fit4cad::Model> model = fit4cad::read_model(number);
    if (!model) continue;
    const fit4cad::Score exact = fit4cad::judge(*model, fit4cad::segment_cloud(model->points));
    add(clean, exact, model->primitives.size());
    const fit4cad::Model thin = fit4cad::noisy_tenth(*model, 0.003, static_cast<unsigned>(number));
    const fit4cad::Score rough = fit4cad::judge(thin, fit4cad::segment_cloud(thin.points));
    add(noisy, rough, thin.primitives.size());
    std::printf(
        "PC%-4d %6zu points %3zu primitives   clean Dice %.3f types %3d found %3d %5.2f s   noisy %.3f types %3d of "
        "%3zu found %3d %5.2f s\n",
        number, model->points.points.size(), model->primitives.size(), exact.dice, exact.types_right, exact.predicted,
        exact.seconds, rough.dice, rough.types_right, thin.primitives.size(), rough.predicted, rough.seconds);
    if (verbose) print_misses(*model, exact);
    if (verbose) std::printf("    --- noisy\n"), print_misses(thin, rough);
    std::fflush(stdout);
  }
  print("clean", clean);
  print("noise of 0.3 % of the diagonal, a tenth of the points", noisy);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> models;
  bool verbose = false;
  for (int i = 1; i < argc; ++i)
    if (std::strcmp(argv[i], "-v") == 0)
      verbose = true;
    else
      models.push_back(std::atoi(argv[i]));
  try {
    return run(verbose, models);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 3;
  }
}
