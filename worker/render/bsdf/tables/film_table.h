#pragma once
// What a dielectric's specular lobe reflects in all under a thin film, for the base below it: see
// iridescence.h.
//
// With k, g and s as in metallic_table.h, F the reflectance at the facet (film or not) and the lobe
// F (1 + F (g g - 1)) k, a table holds E, the largest channel's integral over wi, by the film's thickness,
// alpha and cosine. E is convex in F, so that for a film of weight w over the base, or a metal beside it, the
// mean of the parts' E bounds that of the blend.
#include <vector>

#include "worker/render/bsdf/tables/metallic_table.h"

namespace lightmill {

/// A material's film over what of the base is dielectric.
struct FilmOnBase {
  float ior = 1.3f, thickness_from = 0, thickness_to = 0;  // nm
  /// Reflectances that the base has, f0 per channel and f90: E is the largest of all.
  struct Base {
    float f0[3], f90;
    bool operator==(const Base&) const = default;
  };
  std::vector<Base> bases;
  bool operator==(const FilmOnBase&) const = default;
};

/// A block begins with index, thickness at t = 0, what it grows by to t = 1 and the number of films; then E
/// of the bare base and of films evenly over t, each kMetallicAlphas rows of kCosineNodes; then means of all
/// over diffuse light, kMetallicAlphas each. It is a multiple of kFilmAlign floats long.
inline constexpr int kFilmHead = 4, kFilmAlign = 64;
inline constexpr int kFilmRow = kMetallicAlphas * kCosineNodes;
/// Thicknesses between two films of a table, in nm of the optical way, and the most films.
inline constexpr float kFilmStep = 12;
inline constexpr int kMostFilms = 160;

std::vector<float> film_block(const FilmOnBase& film);

}  // namespace lightmill
