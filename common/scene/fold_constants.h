#pragma once
// What a scene says in a roundabout way: textures that come to one value, mixes that show one part.
#include "common/scene/description.h"

namespace lightmill {

/// Materials and shapes get the value in place of a texture that is the same everywhere, by what its
/// description says (images are not opened), and in place of a mix the part that alone shows; displacements
/// by one height are left out. Textures themselves stay, as do references to constants beyond what the input
/// takes: who reads them warns. Every texture must be made of earlier ones.
void fold_constants(SceneDescription* scene);

}  // namespace lightmill
