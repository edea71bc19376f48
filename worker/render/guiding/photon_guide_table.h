#pragma once
// Makes the photon guide's tables (photon_guide.h) from photons.
#include <vector>

#include "worker/render/guiding/photon_guide.h"

namespace lightmill {

/// Adds one table to `guide`, made of `photons`: as many of them as a table has, each as often as is its due
/// by power. Their directions are followed to the centre of `box`. How wide the lobe around each direction is
/// (GuideLobe) is fitted to all of the photons.
void add_guide_table(const std::vector<const Photon*>& photons, const GuideBox& box, PhotonGuide* guide);

}  // namespace lightmill
