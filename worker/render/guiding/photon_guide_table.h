#pragma once
// Tables of the caustic guide (photon_guide.h) from photons.
#include <vector>

#include "worker/render/guiding/photon_guide.h"

namespace lightmill {

/// Adds one of `photons` to `guide`, whose directions are followed through `box`: as many of them as a table
/// has, by power. How far beside its direction a photon's paths go is fitted to all of them.
void add_guide_table(const std::vector<const Photon*>& photons, const GuideBox& box, PhotonGuide* guide);

}  // namespace lightmill
