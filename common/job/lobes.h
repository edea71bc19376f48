#pragma once
// Lobes: light told apart by the first scattering event that a path has as seen from the camera. The AOV
// `lobes` records each part in a layer of its own; they add up to the image. Other renderers call them light
// passes (Blender) or built-in light path expressions (Arnold, RenderMan).
//
//   diffuse       reflected by a diffuse lobe, or out of a body that light walks through
//   glossy        reflected by any other lobe, mirrors included
//   transmission  goes on beyond the surface, whatever the lobe
//   volume        scattered by a medium
//   emission      no event: what shines is seen by the camera itself
//
// Each of the first four is told apart once more: direct light had no other event, indirect light had.
// A reflection that several lobes take part in is divided by what each of them contributes to the BSDF's
// value (diffuse_share.h), so what a path counts for does not depend on the strategy that made it.
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/job/aovs.h"

namespace lightmill {

/// The parts of light, in the order of their layers. The indirect light of a kind follows the direct one.
enum LobePart : int32_t {
  kDiffuseDirect,
  kDiffuseIndirect,
  kGlossyDirect,
  kGlossyIndirect,
  kTransmissionDirect,
  kTransmissionIndirect,
  kVolumeDirect,
  kVolumeIndirect,
  kEmission,
  kLobeParts
};
inline constexpr std::array<const char*, kLobeParts> kLobeNames = {
    "diffuse_direct",        "diffuse_indirect", "glossy_direct",   "glossy_indirect", "transmission_direct",
    "transmission_indirect", "volume_direct",    "volume_indirect", "emission"};

/// How many parts have sums: all but the last one, which has what they leave of the colour.
inline constexpr size_t lobe_layers(Aovs set) { return set & kAovLobes ? kLobeParts - 1 : 0; }

}  // namespace lightmill
