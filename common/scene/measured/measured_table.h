#pragma once
// A measured BRDF (Dupuy & Jakob 2018), its spectra reduced to RGB.
//
// Directions are polar coordinates around the shading normal; the surface is seen from (phi, theta). A
// direction lies in the unit square at x = sqrt(2 theta / pi), y = phi / (2 pi) + 1/2. Of an isotropic BRDF,
// the facet's phi counts from the viewer's. Half vectors at p of their square are the image of the point q
// for which the warp by `visible` (of uniform to visible facets) takes q to p. Then
//   f cos(theta_i) = rgb(q) ndf(p) / (4 sigma(viewer)),
// and `luminance` over q, warped to p and reflected about the facet, is the density of sampling.
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// Values at the nodes of grids over the unit square, bilinear between them: slices, then rows (y), then x,
/// then `channels`.
struct MeasuredGrid {
  int width = 0, height = 0, channels = 1;  // at least 2 by 2
  std::vector<float> values;                // finite, within [0, 1e9]
};

struct MeasuredTable {
  std::vector<float> phi, theta;  // of the viewer, radians, increasing; at least one of each
  MeasuredGrid ndf, sigma;        // one slice
  MeasuredGrid visible;           // a slice per phi and, faster, theta
  MeasuredGrid luminance, rgb;    // the same; of equal sizes
  bool isotropic() const { return phi.size() <= 2; }  // otherwise phi goes around once
};

/// Largest file of a measured BRDF.
inline constexpr size_t kMaxMeasuredBytes = size_t{1} << 30;

/// Reads the fields phi_i, theta_i, ndf, sigma, vndf, luminance, and spectra with wavelengths, or rgb;
/// others are left alone, and negative values are 0. Throws Error(kBadScene) with a phrase for what is
/// missing or not as above. Memory stays within that of the data.
MeasuredTable parse_measured(std::string_view data);
/// The same from a file.
MeasuredTable read_measured_file(const std::string& path);

}  // namespace lightmill
