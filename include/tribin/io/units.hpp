#pragma once

#include <string_view>

namespace tribin {

/// The unit of a file's lengths. Inside tribin all lengths are millimetres.
enum class LengthUnit { automatic, millimetre, centimetre, metre, inch };

/// Millimetres in one unit; LengthUnit::automatic has none and is a broken contract here.
double millimetres_in(LengthUnit unit);

/// "mm" | "cm" | "m" | "inch" | "auto".
/// \throws Error bad_option for any other name.
LengthUnit length_unit_from_name(std::string_view name);

std::string_view name_of(LengthUnit unit);

}  // namespace tribin
