#pragma once
// Radiative transfer in a coat that scatters, averaged over azimuth: the adding-doubling method (van de Hulst
// 1980, "Multiple light scattering") over kStreams directions. In double with plain loops, so that a scene's
// tables have the same bits on every machine.
//
// A field is the energy in each stream on its way up or down, per unit of arriving energy; an operator maps
// fields to fields, [to][from]. Streams lie at the Gauss-Legendre cosines of (0, 1).
#include <array>

#include "worker/render/bsdf/layered/coat_crossing.h"

namespace lightmill {

inline constexpr int kStreams = 32;
using Field = std::array<double, kStreams>;
using Operator = std::array<Field, kStreams>;

/// Cosines of the streams, rising, and the weights of the quadrature over (0, 1).
struct Streams {
  Field cosine, weight;
};
const Streams& streams();

/// What a layer without interfaces does to light that meets it, from either side alike.
struct Slab {
  Operator reflect, transmit;
};
/// A medium of optical thickness `thickness` (times unit cosine), single-scattering albedo in [0, 1] and
/// Henyey-Greenstein asymmetry g.
Slab scattering_slab(double thickness, double albedo, double g);
/// The same medium without what it scatters: it only dims.
Slab dimming_slab(double thickness);

/// The coat's interface, from inside.
Operator coat_inside_reflection(const CoatDescription& coat);
/// Energy that gets out of the coat's interface, of each stream that meets it from inside.
Field coat_leaving(const CoatDescription& coat);
/// Energy that enters from outside at `cosine`, by stream.
Field coat_entering_field(const CoatDescription& coat, float cosine);
/// GGX facets that reflect everything. alpha at or below kSmoothAlpha: a mirror.
Operator facet_reflection(float alpha);

/// Light between a coat's interface and its base, after all its rounds.
struct CoatResponse {
  Operator top_of_entering;   // what gets up to the interface, of what has started below it
  Operator base_of_entering;  // what gets down to the base, of the same
  Operator base_of_base;      // what gets down to the base, of what has started above it
};
/// `interface`: reflection of the top from inside; `base`: reflection of the base.
CoatResponse coat_response(const Slab& slab, const Operator& interface, const Operator& base);

Field product(const Operator& a, const Field& x);

}  // namespace lightmill
