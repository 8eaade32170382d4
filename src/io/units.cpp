#include "tribin/io/units.hpp"

#include <string>

#include "tribin/core/error.hpp"

namespace tribin {

double millimetres_in(LengthUnit unit) {
  TRIBIN_ASSERT(unit != LengthUnit::automatic);
  switch (unit) {
    case LengthUnit::centimetre:
      return 10;
    case LengthUnit::metre:
      return 1000;
    case LengthUnit::inch:
      return 25.4;
    default:
      return 1;
  }
}

LengthUnit length_unit_from_name(std::string_view name) {
  for (LengthUnit unit :
       {LengthUnit::automatic, LengthUnit::millimetre, LengthUnit::centimetre, LengthUnit::metre, LengthUnit::inch}) {
    if (name == name_of(unit)) return unit;
  }
  throw Error(ErrorCode::bad_option, "unit: saw \"" + std::string(name) + "\", wanted mm, cm, m, inch or auto");
}

std::string_view name_of(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::automatic:
      return "auto";
    case LengthUnit::centimetre:
      return "cm";
    case LengthUnit::metre:
      return "m";
    case LengthUnit::inch:
      return "inch";
    default:
      return "mm";
  }
}

}  // namespace tribin
