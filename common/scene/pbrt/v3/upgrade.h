#pragma once
// Directives of pbrt-v3 in the words of pbrt-v4, so that both come to the same description. The rules are
// those of pbrt-v4's `--upgrade`; where a v3 file leaves something out, v3's default is put in;
// docs/pbrt-v3.md lists both. Materials are in materials.h.
#include <string>
#include <vector>

#include "common/scene/pbrt/syntax/params.h"

namespace lightmill::v3 {

enum class Directive {
  kCamera,
  kFilm,
  kPixelFilter,
  kSampler,
  kIntegrator,
  kLight,
  kAreaLight,
  kTexture,
  kShape,
  kMedium,
};

/// Rewrites the directive's type and its parameters. What has no counterpart is warned of at `where`.
void upgrade(Directive directive, const SourceLocation& where, std::string* type,
             std::vector<Parameter>* parameters, ProblemList* problems);

/// "blackbody" of two numbers, temperature and scale, as a light has it: becomes one number, and "scale".
void upgrade_blackbody(std::vector<Parameter>* parameters);

}  // namespace lightmill::v3
