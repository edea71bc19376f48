#pragma once
// Materials of pbrt-v3 in the words of pbrt-v4 (rules as in upgrade.h), and what needs more than words.
#include <optional>
#include <string>
#include <vector>

#include "common/scene/pbrt/scene.h"

namespace lightmill::v3 {

/// Names that pbrt-v4 does not have. Others ("mix", "hair", "subsurface") have parameters of other names.
bool is_material(const std::string& type);

/// Rewrites the type and the parameters. What has no counterpart is warned of at `where`. "disney" stays, as
/// read_disney wants it, and so does "opacity", as read_opacity does.
void upgrade_material(const SourceLocation& where, std::string* type, std::vector<Parameter>* parameters,
                      ProblemList* problems);

/// Disney's "principled" BSDF by glTF's, which has most of it.
MaterialKind read_disney(PbrtScene& out, ParameterList& params);

/// What "opacity" of "uber" says: shapes of the material have it as alpha. Nothing if there is none.
std::optional<FloatInput> read_opacity(PbrtScene& out, ParameterList& params);

}  // namespace lightmill::v3
