#pragma once

#include <filesystem>
#include <span>

#include "tribin/finder/finder.hpp"

namespace tribin {

/// Writes DIR/figure1.svg to figure3.svg: the paper's figures 1 to 3 drawn from a scan and a part, each one file that
/// loads nothing: the chain of stages; normals, IJK space and parameter space; how two key cylinders and a plane fix a
/// pose.
/// \param found  by Method::paper, with an instance whose evidence holds two key cylinders and a plane.
/// \throws Error too_little_data when there is no such instance; bad_option when a file cannot be written.
void write_paper_figures(const std::filesystem::path& dir, const Scan& scan, std::span<const Part> parts,
                         const Found& found);

}  // namespace tribin
