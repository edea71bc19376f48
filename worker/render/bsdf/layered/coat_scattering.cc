#include "worker/render/bsdf/layered/coat_scattering.h"

#include <cmath>

#include "worker/render/bsdf/layered/coat_transfer.h"

namespace lightmill {
namespace {

constexpr size_t kNodes = kCosineNodes;

/// What does not depend on the channel.
struct Interface {
  CoatDescription coat;
  Operator inside;
  Field leaving;
  std::array<Field, kNodes> entering;
  std::array<CoatSide<float>, kNodes> side;
};

CoatSide<float> side_of(const CoatDescription& coat, float cosine) {
  const Vec3<float> w = coat_direction(cosine);
  CoatSide<float> s;
  float cos_t;
  s.transmittance = 1 - fresnel_dielectric(cosine, coat.eta, &cos_t);
  s.inside = {w.x / coat.eta, 0, std::max(cos_t, 1e-6f)};
  if (coat.alpha > kSmoothAlpha)
    s.transmittance = 1 - fresnel_dielectric(facet_cosine(w, coat.alpha), coat.eta, &cos_t);
  s.cosine = cosine;
  return s;
}

Interface make_interface(const CoatDescription& coat) {
  Interface made{coat, coat_inside_reflection(coat), coat_leaving(coat), {}, {}};
  for (size_t i = 0; i < kNodes; ++i) {
    const float cosine = node_cosine(static_cast<int>(i));
    made.entering[i] = coat_entering_field(coat, cosine);
    made.side[i] = side_of(coat, cosine);
  }
  return made;
}

/// Mean over azimuth of f_1 over the albedo.
double mean_once(const Interface& top, size_t o, size_t i, float g) {
  constexpr int kAzimuths = 64;
  const CoatScattering<float> lobe{nullptr, 0};
  double sum = 0;
  for (int k = 0; k < kAzimuths; ++k) {
    const double angle = M_PI * (k + 0.5) / kAzimuths;
    CoatSide<float> turned = top.side[i];
    turned.inside.y = static_cast<float>(turned.inside.x * std::sin(angle));
    turned.inside.x = static_cast<float>(turned.inside.x * std::cos(angle));
    sum += lobe.once(top.side[o], turned, top.coat.eta, top.coat.thickness, g);
  }
  return sum / kAzimuths;
}

using Table = std::array<std::array<double, kNodes>, kNodes>;

/// Integral over the upper hemisphere of a row of f, times the cosine: between its nodes linear, so that
/// Simpson's rule is exact.
double row_albedo(const std::array<double, kNodes>& f) {
  double sum = 0;
  for (size_t i = 0; i + 1 < kNodes; ++i) {
    const double h = 1.0 / (kNodes - 1), a = static_cast<double>(i) * h;
    sum += h / 6 * (f[i] * a + (f[i] + f[i + 1]) * (2 * a + h) + f[i + 1] * (a + h));
  }
  return 2 * M_PI * sum;
}

/// Factors of both directions give every row of a symmetric `f` its albedo: what the streams, which are few,
/// miss at the interface's critical angle (symmetric matrix scaling, as in albedo_table.h).
void keep_energy(const std::array<double, kNodes>& albedo, Table* f) {
  for (int n = 0; n < 24; ++n) {
    std::array<double, kNodes> factor;
    for (size_t o = 0; o < kNodes; ++o) {
      const double now = row_albedo((*f)[o]);
      factor[o] = now > 0 ? std::sqrt(std::max(albedo[o], 0.0) / now) : 1;
    }
    for (size_t o = 0; o < kNodes; ++o) {
      for (size_t i = 0; i < kNodes; ++i) (*f)[o][i] *= factor[o] * factor[i];
    }
  }
}

/// S of one channel to `table`; returns the albedo of f_s for diffuse light. `all`: of the medium with what
/// it scatters; `straight`: without.
double fill_table(const Interface& top, const CoatResponse& all, const CoatResponse& straight, float albedo,
                  float g, float* table) {
  const Streams& s = streams();
  const double eta2 = double{top.coat.eta} * top.coat.eta;
  std::array<Field, kNodes> scattered;  // radiance below the interface times pi
  std::array<double, kNodes> share{};   // of what arrives at a cosine: leaves after having been scattered
  for (size_t i = 0; i < kNodes; ++i) {
    const Field any_way = product(all.top_of_entering, top.entering[i]),
                unscattered = product(straight.top_of_entering, top.entering[i]);
    for (size_t k = 0; k < kStreams; ++k) {
      const double energy = any_way[k] - unscattered[k];
      share[i] += energy * top.leaving[k];
      scattered[i][k] = energy / (2 * s.cosine[k] * s.weight[k]);
    }
  }
  // What leaves along a direction is what would enter along it (reciprocity).
  const auto radiance = [&](size_t o, size_t i) {
    double sum = 0;
    for (size_t k = 0; k < kStreams; ++k) sum += top.entering[o][k] * scattered[i][k];
    return sum / (M_PI * eta2);
  };
  Table f;
  for (size_t o = 0; o < kNodes; ++o) {
    for (size_t i = 0; i < kNodes; ++i) f[o][i] = 0.5 * (radiance(o, i) + radiance(i, o));
  }
  keep_energy(share, &f);
  for (size_t o = 0; o < kNodes; ++o) {
    for (size_t i = 0; i < kNodes; ++i) {
      table[o * kNodes + i] =
          static_cast<float>(std::max(f[o][i] - double{albedo} * mean_once(top, o, i, g), 0.0));
    }
  }
  return 2 * row_albedo(share) / (2 * M_PI);
}

std::vector<float> empty_block(const CoatMedium& medium) {
  std::vector<float> block(kScatteringBlock, 0.0f);
  std::copy(medium.albedo.begin(), medium.albedo.end(), block.begin());
  block[3] = medium.g;
  block[kBaseAnisotropy] = block[kCoatAnisotropy] = 1;
  return block;
}

double entering_share(const Interface& top) {
  double sum = 0, weight = 0;
  for (const CoatSide<float>& s : top.side) {
    sum += double{s.transmittance} * s.cosine;
    weight += s.cosine;
  }
  return sum / weight;
}

double energy(const Field& field) {
  double sum = 0;
  for (const double x : field) sum += x;
  return sum;
}

/// Calls fn(channel, slab), the slabs of equal albedos being made once.
template <class Fn>
void per_channel(const CoatDescription& coat, const CoatMedium& medium, Fn&& fn) {
  Slab slab;
  for (size_t c = 0; c < 3; ++c) {
    if (c == 0 || medium.albedo[c] != medium.albedo[c - 1])
      slab = scattering_slab(coat.thickness, medium.albedo[c], medium.g);
    fn(c, slab);
  }
}

}  // namespace

ScatteringCoat scattering_coat(const CoatDescription& coat, const CoatMedium& medium) {
  const Interface top = make_interface(coat);
  ScatteringCoat made{empty_block(medium), {}, {}, 0};
  const Operator black{};
  const CoatResponse straight = coat_response(dimming_slab(coat.thickness), top.inside, black);
  Field diffuse;
  for (size_t k = 0; k < kStreams; ++k) diffuse[k] = 2 * streams().cosine[k] * streams().weight[k];
  double albedo = 0;
  per_channel(coat, medium, [&](size_t c, const Slab& slab) {
    float* const table = made.block.data() + kCosineNodes + c * kScatteringTable;
    const CoatResponse all = coat_response(slab, top.inside, black);
    albedo = std::max(albedo, fill_table(top, all, straight, medium.albedo[c], medium.g, table));
    made.returned[c] = energy(product(all.base_of_base, diffuse));
    double entering = 0, weight = 0;
    for (size_t i = 0; i < kNodes; ++i) {
      const double down = energy(product(all.base_of_entering, top.entering[i]));
      const CoatSide<float>& s = top.side[i];
      made.entering[c][i] = s.transmittance > 0 ? static_cast<float>(down / s.transmittance) : 0.0f;
      entering += down * s.cosine;
      weight += s.cosine;
    }
    made.entering_mean = std::max(made.entering_mean, static_cast<float>(entering / weight));
  });
  made.block[4] = static_cast<float>(albedo / std::max(entering_share(top), 1e-6));
  return made;
}

std::vector<float> scattering_coat_over_metal(const CoatDescription& coat, const CoatMedium& medium,
                                              float metal_alpha, const std::array<float, 3>& reflectance) {
  const Interface top = make_interface(coat);
  std::vector<float> block = empty_block(medium);
  const Operator white = facet_reflection(metal_alpha);
  double albedo = 0;
  per_channel(coat, medium, [&](size_t c, const Slab& slab) {
    Operator base = white;
    for (Field& row : base) {
      for (double& x : row) x *= reflectance[c];
    }
    float* const table = block.data() + kCosineNodes + c * kScatteringTable;
    const CoatResponse all = coat_response(slab, top.inside, base),
                       straight = coat_response(dimming_slab(coat.thickness), top.inside, base);
    albedo = std::max(albedo, fill_table(top, all, straight, medium.albedo[c], medium.g, table));
  });
  block[4] = static_cast<float>(albedo / std::max(entering_share(top), 1e-6));
  return block;
}

}  // namespace lightmill
