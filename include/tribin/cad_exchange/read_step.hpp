#pragma once

#include <string>

#include "tribin/cad/mesh.hpp"

namespace tribin {

/// How exact surfaces become triangles.
struct TessellationOptions {
  double chord_error_mm = 0.02;  ///< largest distance of a triangle from its surface [mm], > 0
  double angle = 0.5;  ///< largest turn of the normal along one edge [rad], in (0, 1.5]; 0.5 keeps small fillets
                       ///< and screw holes from taking more triangles than the rest of the part together
};

/// Reads a STEP file (AP203, AP214, AP242): all of its solids as one rigid part, with the exact surface of each face.
/// Lengths are converted from the file's unit to mm. Vertices are welded across faces, so that a closed solid gives a
/// closed mesh. Surfaces that are written as swept or as splines but are planes, cylinders, cones or spheres are named
/// so. \param path     .step or .stp file. \param options  of the tessellation. \return         mesh with
/// face_of_triangle and faces; `oriented` is false if a face belongs to no closed solid. \throws Error   bad_input: not
/// there, not a STEP file, or without any face; bad_option: options out of range.
Mesh read_step(const std::string& path, const TessellationOptions& options = {});

/// Reads an IGES file (B-rep solids or loose faces; loose faces are sewn). As read_step else.
Mesh read_iges(const std::string& path, const TessellationOptions& options = {});

/// Makes read_cad read .step, .stp, .iges and .igs. A program calls it once, before it reads any file.
void register_cad_exchange();

}  // namespace tribin
