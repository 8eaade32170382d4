#pragma once

#include <string>

#include "tribin/eval/figures.hpp"

namespace tribin {

/// Judged results for people: tables by level and class, confidence where there is any, each figure with its count and
/// 95 % interval. \param list  also every missed part and every false answer, one a line.
std::string eval_text(const eval::Judged& judged, bool list);

/// The same for programs, with every missed part and every false answer.
std::string eval_json(const eval::Judged& judged);

}  // namespace tribin
