#include "worker/render/bsdf/layered/coat_transfer.h"

#include <cmath>
#include <utility>

namespace lightmill {
namespace {

constexpr size_t kN = kStreams;
constexpr int kFacetStrata = 16;  // stratification of integrals over facets

Operator identity() {
  Operator m{};
  for (size_t i = 0; i < kN; ++i) m[i][i] = 1;
  return m;
}

Operator product(const Operator& a, const Operator& b) {
  Operator m{};
  for (size_t i = 0; i < kN; ++i) {
    for (size_t k = 0; k < kN; ++k) {
      const double x = a[i][k];
      if (x == 0) continue;
      for (size_t j = 0; j < kN; ++j) m[i][j] += x * b[k][j];
    }
  }
  return m;
}
Operator sum(Operator a, const Operator& b) {
  for (size_t i = 0; i < kN; ++i) {
    for (size_t j = 0; j < kN; ++j) a[i][j] += b[i][j];
  }
  return a;
}
/// (1 - a)^-1 b: everything that a keeps sending round. Gauss-Jordan elimination with pivots.
Operator all_rounds(const Operator& a, Operator b) {
  Operator left = identity();
  for (size_t i = 0; i < kN; ++i) {
    for (size_t j = 0; j < kN; ++j) left[i][j] -= a[i][j];
  }
  for (size_t c = 0; c < kN; ++c) {
    size_t pivot = c;
    for (size_t i = c + 1; i < kN; ++i) {
      if (std::fabs(left[i][c]) > std::fabs(left[pivot][c])) pivot = i;
    }
    std::swap(left[c], left[pivot]);
    std::swap(b[c], b[pivot]);
    const double inverse = 1 / left[c][c];
    for (size_t j = 0; j < kN; ++j) {
      left[c][j] *= inverse;
      b[c][j] *= inverse;
    }
    for (size_t i = 0; i < kN; ++i) {
      const double x = left[i][c];
      if (i == c || x == 0) continue;
      for (size_t j = 0; j < kN; ++j) {
        left[i][j] -= x * left[c][j];
        b[i][j] -= x * b[c][j];
      }
    }
  }
  return b;
}

/// Henyey-Greenstein's function averaged over azimuth, between the streams: [0] within a half space, [1] from
/// one into the other. Times the weights it sums to 1 over all directions.
std::array<Operator, 2> phase_function(double g) {
  constexpr int kAzimuths = 256;
  const Streams& s = streams();
  std::array<Operator, 2> p{};
  for (size_t i = 0; i < kN; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      const double sines = std::sqrt((1 - s.cosine[i] * s.cosine[i]) * (1 - s.cosine[j] * s.cosine[j]));
      for (const size_t other : {0u, 1u}) {
        const double cosines = (other == 0 ? 1 : -1) * s.cosine[i] * s.cosine[j];
        double mean = 0;
        for (int k = 0; k < kAzimuths; ++k) {
          const double c = cosines + sines * std::cos(M_PI * (k + 0.5) / kAzimuths);
          const double d = std::max(1 + g * g - 2 * g * c, 1e-12);
          mean += (1 - g * g) / (2 * d * std::sqrt(d)) / kAzimuths;
        }
        p[other][i][j] = p[other][j][i] = mean;
      }
    }
  }
  // A sharp peak falls between the streams: factors of both directions give every stream its sum of 1.
  for (int n = 0; n < 64; ++n) {
    Field factor;
    for (size_t j = 0; j < kN; ++j) {
      double total = 0;
      for (size_t i = 0; i < kN; ++i) total += s.weight[i] * (p[0][i][j] + p[1][i][j]);
      factor[j] = 1 / std::sqrt(total);
    }
    for (Operator& half : p) {
      for (size_t i = 0; i < kN; ++i) {
        for (size_t j = 0; j < kN; ++j) half[i][j] *= factor[i] * factor[j];
      }
    }
  }
  return p;
}

/// Adds energy that travels at `cosine` to the streams on either side of it.
void add_energy(double cosine, double energy, Field* to) {
  const Field& c = streams().cosine;
  size_t above = 0;
  while (above < kN && c[above] < cosine) ++above;
  if (above == 0 || above == kN) {
    (*to)[above == 0 ? 0 : kN - 1] += energy;
    return;
  }
  const double t = (cosine - c[above - 1]) / (c[above] - c[above - 1]);
  (*to)[above] += t * energy;
  (*to)[above - 1] += (1 - t) * energy;
}

/// Calls fn(u, v) with the middles of a grid's cells.
template <class Fn>
void over_grid(Fn&& fn) {
  for (int row = 0; row < kFacetStrata; ++row) {
    for (int column = 0; column < kFacetStrata; ++column)
      fn((static_cast<float>(column) + 0.5f) / kFacetStrata, (static_cast<float>(row) + 0.5f) / kFacetStrata);
  }
}
constexpr double kCell = 1.0 / (kFacetStrata * kFacetStrata);

/// Calls fn(stream, share, crossing) with what the energy in each stream meets. A stream stands for the
/// directions around it: at the critical angle the interface's reflectance jumps between two of them.
template <class Fn>
void meet_from_inside(const CoatDescription& coat, Fn&& fn) {
  constexpr int kParts = 16;
  const Streams& s = streams();
  double edge = 0;
  for (size_t j = 0; j < kN; ++j) {
    double flux = 0;
    const auto part = [&](int i) { return edge + s.weight[j] * (i + 0.5) / kParts; };
    for (int i = 0; i < kParts; ++i) flux += part(i);
    for (int i = 0; i < kParts; ++i) {
      const Vec3<float> from = coat_direction(static_cast<float>(part(i)));
      const double share = part(i) / flux;
      if (coat.alpha <= kSmoothAlpha) {
        fn(j, share, cross_coat(0, 1 / coat.eta, from, 0.5f, 0.5f));
      } else {
        over_grid([&](float u, float v) {
          fn(j, share * kCell, cross_coat(coat.alpha, 1 / coat.eta, from, u, v));
        });
      }
    }
    edge += s.weight[j];
  }
}

Operator columns(const std::array<Field, kN>& by_source) {
  Operator m;
  for (size_t i = 0; i < kN; ++i) {
    for (size_t j = 0; j < kN; ++j) m[i][j] = by_source[j][i];
  }
  return m;
}

Streams make_streams() {
  Streams s;
  for (int i = 0; i < kStreams; ++i) {
    // Newton's method on the Legendre polynomial of degree kStreams, from Tricomi's estimate.
    double x = -std::cos(M_PI * (i + 0.75) / (kStreams + 0.5)), slope = 0;
    for (int n = 0; n < 20; ++n) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= kStreams; ++k) p0 = std::exchange(p1, ((2 * k - 1) * x * p1 - (k - 1) * p0) / k);
      slope = kStreams * (x * p1 - p0) / (x * x - 1);
      x -= p1 / slope;
    }
    const auto at = static_cast<size_t>(i);
    s.cosine[at] = 0.5 * (1 + x);
    s.weight[at] = 1 / ((1 - x * x) * slope * slope);
  }
  return s;
}

}  // namespace

const Streams& streams() {
  static const Streams made = make_streams();
  return made;
}

Slab dimming_slab(double thickness) {
  Slab slab{};
  for (size_t i = 0; i < kN; ++i) slab.transmit[i][i] = std::exp(-thickness / streams().cosine[i]);
  return slab;
}

// A layer so thin that light is scattered in it once at most (its error is the square of 2^-20 over the
// smallest cosine), doubled until it is thick enough.
Slab scattering_slab(double thickness, double albedo, double g) {
  int doublings = 0;
  double thin = thickness;
  while (thin > 0x1p-20) thin *= 0.5, ++doublings;
  Slab slab = dimming_slab(thin);
  const Streams& s = streams();
  const std::array<Operator, 2> phase = phase_function(g);
  for (size_t i = 0; i < kN; ++i) {
    for (size_t j = 0; j < kN; ++j) {
      const double a = s.cosine[i], b = s.cosine[j], both = thin / a + thin / b;
      slab.reflect[i][j] = albedo * phase[1][i][j] * s.weight[i] * a / (a + b) * -std::expm1(-both);
      // (exp(-thin / b) - exp(-thin / a)) a / (b - a), its limit where both are the same.
      const double apart = thin / a - thin / b;
      const double share = std::fabs(apart) < 1e-12 ? 1 : -std::expm1(-apart) / apart;
      slab.transmit[i][j] += albedo * phase[0][i][j] * s.weight[i] * std::exp(-thin / b) * share * thin / b;
    }
  }
  for (int n = 0; n < doublings; ++n) {
    // Light that crosses the first half, and goes to and fro between the halves.
    const Operator down = all_rounds(product(slab.reflect, slab.reflect), slab.transmit);
    slab.reflect = sum(slab.reflect, product(slab.transmit, product(slab.reflect, down)));
    slab.transmit = product(slab.transmit, down);
  }
  return slab;
}

Operator coat_inside_reflection(const CoatDescription& coat) {
  std::array<Field, kN> by_source{};
  meet_from_inside(coat, [&](size_t stream, double share, const CoatCrossing& x) {
    if (coat.alpha <= kSmoothAlpha) {
      by_source[stream][stream] += share * x.reflectance;
    } else if (x.reflectance > 0) {
      add_energy(x.reflected.z, share * x.reflectance, &by_source[stream]);
    }
  });
  return columns(by_source);
}

Field coat_leaving(const CoatDescription& coat) {
  Field leaving{};
  meet_from_inside(coat, [&](size_t stream, double share, const CoatCrossing& x) {
    leaving[stream] += share * x.transmittance;
  });
  return leaving;
}

Field coat_entering_field(const CoatDescription& coat, float cosine) {
  Field field{};
  over_grid([&](float u, float v) {
    const CoatCrossing x = cross_coat(coat.alpha, coat.eta, coat_direction(cosine), u, v);
    if (x.transmittance > 0) add_energy(-x.transmitted.z, x.transmittance * kCell, &field);
  });
  return field;
}

Operator facet_reflection(float alpha) {
  if (alpha <= kSmoothAlpha) return identity();
  std::array<Field, kN> by_source{};
  for (size_t j = 0; j < kN; ++j) {
    const Vec3<float> from = coat_direction(static_cast<float>(streams().cosine[j]));
    over_grid([&](float u, float v) {
      const Vec3<float> m = coat_facet(alpha, from, u, v);
      const Vec3<float> to = m * (2 * dot(from, m)) - from;
      if (to.z > 0) add_energy(to.z, coat_unmasked(alpha, from, to) * kCell, &by_source[j]);
    });
  }
  return columns(by_source);
}

Field product(const Operator& a, const Field& x) {
  Field y{};
  for (size_t i = 0; i < kN; ++i) {
    for (size_t k = 0; k < kN; ++k) y[i] += a[i][k] * x[k];
  }
  return y;
}

// With d below the interface, u above the base, and what starts there:
//   d = entering + I (R d + T u),   u = leaving + B (T d + R u).
CoatResponse coat_response(const Slab& slab, const Operator& interface, const Operator& base) {
  // u = (1 - B R)^-1 (leaving + B T d), put into the first.
  const Operator u_of_leaving = all_rounds(product(base, slab.reflect), identity());
  const Operator climb = product(slab.transmit, u_of_leaving);
  const Operator base_of_d = product(base, slab.transmit);
  const Operator d_of_entering =
      all_rounds(product(interface, sum(slab.reflect, product(climb, base_of_d))), identity());
  const Operator u_of_entering = product(u_of_leaving, product(base_of_d, d_of_entering));
  const Operator d_of_leaving = product(d_of_entering, product(interface, climb));
  const Operator u_of_all_leaving =
      sum(u_of_leaving, product(u_of_leaving, product(base_of_d, d_of_leaving)));
  return {sum(product(slab.reflect, d_of_entering), product(slab.transmit, u_of_entering)),
          sum(product(slab.transmit, d_of_entering), product(slab.reflect, u_of_entering)),
          sum(product(slab.transmit, d_of_leaving), product(slab.reflect, u_of_all_leaving))};
}

}  // namespace lightmill
