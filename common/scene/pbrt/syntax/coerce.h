#pragma once
// Parameters whose type is not the one that is asked for, but can stand for it: whole numbers for floats,
// "true" for a bool, three floats for a colour, a point for a vector.
#include <initializer_list>

#include "common/scene/pbrt/syntax/params.h"

namespace lightmill {

/// Makes `parameter` one of the first of `types` that it can stand for; false, and no change, if there is
/// none.
bool coerce(std::initializer_list<ParamType> types, Parameter* parameter);

}  // namespace lightmill
