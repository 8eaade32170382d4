#pragma once

#include <optional>
#include <string>

#include "tribin/report/report.hpp"

namespace tribin::report {

// The sections of the page, each from the values that the JSON gives too.

std::string poses_section(const Scan& scan, std::span<const Part> parts, const Found& found,
                          const std::optional<ReportTruth>& truth);
std::string evidence_section(std::span<const Part> parts, const Found& found);
std::string why_not_section(std::span<const Part> parts, const Found& found);
/// Where the bin stands, how full it is, and what is left unexplained; empty where there is nothing to tell.
std::string bin_section(const Scan& scan, const Found& found);
/// Milliseconds a stage beside the paper's table I, on a logarithmic scale.
std::string time_section(const StageTimes& times, int threads);
std::string again_section(const ReportContext& context);
/// \param key_of  id -> the key that links a row with the pictures (links.hpp).
std::string primitives_section(const std::vector<Primitive>& primitives, const Pose& b_from_a, const std::string& lead,
                               std::string (*key_of)(int id));
std::string warning_lines(const std::vector<Warning>& warnings, const std::vector<std::string>& more);

/// 0 = A, ...: the place of the part in the list; -1 if it is not there.
int class_of(std::span<const Part> parts, const std::string& name);

}  // namespace tribin::report
