#include <algorithm>

#include "hypotheses.hpp"
#include "tribin/paper_method/tests.hpp"

namespace tribin::paper {
namespace {

/// Each observed cylinder against each one of the model: r first, then h.
std::vector<Match> matched_cylinders(const Object& object, const Part& part, const Check& check) {
  std::vector<Match> out;
  for (const Primitive& model : part.model.primitives) {
    if (model.type != PrimitiveType::cylinder || model.concave) continue;
    for (const Primitive* seen : object.cylinders) {
      const TestResult r = cylinder_radius(*seen, model);
      if (!check(r)) continue;
      const TestResult h = cylinder_height(*seen, model);
      if (check(h)) out.push_back({seen, &model, {r, h}});
    }
  }
  return out;
}

double largest_radius(const Part& part) {
  double out = 0;
  for (const Primitive& p : part.model.primitives)
    if (p.type == PrimitiveType::cylinder && !p.concave) out = std::max(out, p.radius_mm);
  return out;
}

/// Keeps those whose points lie on the ideal cylinder, the best fitting first.
std::vector<Match> on_ideal_cylinders(std::vector<Match> matches, const Surfels& surfels, const Check& check) {
  std::vector<Match> out;
  for (Match& match : matches) {
    match.tests.push_back(superquadric(*match.seen, surfels));
    if (check(match.tests.back())) out.push_back(std::move(match));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Match& a, const Match& b) { return a.tests.back().value < b.tests.back().value; });
  return out;
}

}  // namespace

std::vector<KeyPair> key_pairs(const Object& object, const Part& part, const Surfels& surfels, const Check& check) {
  const std::vector<Match> matches = on_ideal_cylinders(matched_cylinders(object, part, check), surfels, check);
  const double largest_mm = largest_radius(part);
  std::vector<KeyPair> out;
  for (const Match& main : matches) {
    const TestResult largest = largest_cylinder(*main.model, largest_mm);
    if (!check(largest)) continue;
    for (const Match& sub : matches) {
      if (sub.seen == main.seen || sub.model == main.model) continue;
      const TestResult close_model = sub_cylinder(*main.model, *sub.model, part.diameter_mm);
      if (!close_model.passed) continue;  // not a sub-cylinder of the model: nothing was refused
      KeyPair pair{main, sub};
      pair.main.tests.push_back(largest);
      bool passed = true;
      for (const TestResult& test :
           {sub_cylinder(*main.seen, *sub.seen, part.diameter_mm),
            cylinder_angle(*main.seen, *sub.seen, *main.model, *sub.model),
            cylinder_distance(*main.seen, *sub.seen, *main.model, *sub.model, part.diameter_mm)}) {
        pair.sub.tests.push_back(test);
        passed = passed && check(test);
      }
      if (passed) out.push_back(std::move(pair));
    }
  }
  return out;
}

}  // namespace tribin::paper
