#pragma once
// The density of pbrt's "cloud" on a lattice.
#include "common/scene/medium_description.h"

namespace lightmill {

/// The density at a point of medium space (pbrt-v4, CloudMedium).
float cloud_density(const CloudDensity& cloud, const Vec3d& p);

/// It at the voxels of a lattice over the box and half a voxel beyond: four of them for a cell of the finest
/// noise, but at most kMostCloudVoxels along the longest side. Finer noise is smoothed.
VolumeField cloud_field(const CloudDensity& cloud, const Vec3d& lo, const Vec3d& hi, int threads);
inline constexpr int kMostCloudVoxels = 256;

}  // namespace lightmill
