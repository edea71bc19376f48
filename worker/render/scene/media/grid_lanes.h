#pragma once
// Coefficients and emission of media that vary, at points of their grids; a medium per lane.
#include <bit>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

template <class F>
inline F component(const Vec3<F>& v, IntOf<F> which) {
  return select(MaskOf<F>(which == 0), v.x, select(MaskOf<F>(which == 1), v.y, v.z));
}
template <class F>
inline Vec3<F> non_negative(const Vec3<F>& v) {
  return {max(v.x, F{}), max(v.y, F{}), max(v.z, F{})};
}

template <class F>
struct MediumCoefficients {
  Vec3<F> extinction, scattering;
  F density;  // of a grid with one channel
};

/// The grids of one medium per lane.
template <class F>
class Grids {
 public:
  Grids(const RenderScene& scene, IntOf<F> medium, MaskOf<F> active)
      : table_(scene.volumes),
        medium_(scene.media.data(), medium),
        extinction_(medium_.rgb(kMediumExtinction)),
        scattering_(medium_.rgb(kMediumScattering)),
        record_(select(active, (medium_.grid() - 1) * kGridFloats, IntOf<F>{})),
        coefficients_{table_, record_ + kGridCoefficients},
        own_(MaskOf<F>(integer(kGridChannels) != 1)),
        any_own_(any(mask_and(active, own_))),
        collides_(medium_.scalar(kMediumCollides)) {}

  const FieldLanes<F>& field() const { return coefficients_; }
  Vec3<F> rgb(int slot) const { return {number(slot), number(slot + 1), number(slot + 2)}; }
  IntOf<F> integer(int slot) const {
    return gather(reinterpret_cast<const int32_t*>(table_.records.data()) + slot, record_);
  }
  F majorant(IntOf<F> brick) const { return gather(table_.majorants.data(), brick); }
  /// 1 where paths may end a segment.
  F collides() const { return collides_; }

  [[gnu::always_inline]] MediumCoefficients<F> at(const FieldCell<F>& c) const {
    const F density = field_value<F>(table_, c);
    MediumCoefficients<F> k{medium_.rgb(kMediumExtinction) * density,
                            medium_.rgb(kMediumScattering) * density, density};
    if (!any_own_) return k;
    // Lanes with one channel read something that exists, and leave it.
    FieldCell<F> own = c;
    own.brick = select(own_, c.brick, splat_int<F>(some_own_brick()));
    const auto value = [&](int channel) { return field_value<F>(table_, own, channel); };
    const Vec3<F> a{value(0), value(1), value(2)}, s{value(3), value(4), value(5)};
    return {select(own_, a + s, k.extinction), select(own_, s, k.scattering), density};
  }

  /// Radiance per unit length at a point of normalised space with these coefficients.
  Vec3<F> emission(const MediumCoefficients<F>& k, const Vec3<F>& p, MaskOf<F> mask) const {
    const IntOf<F> kind = integer(kGridEmissionKind);
    mask = mask_and(mask, MaskOf<F>(kind != kNoEmission));
    if (!any(mask)) return {};
    Vec3<F> e = medium_.rgb(kMediumEmission);
    e = e * select(own_, non_negative(k.extinction - k.scattering), splat3<F>(1, 1, 1) * k.density);
    const MaskOf<F> scaled = mask_and(mask, MaskOf<F>(kind == kScaledEmission)),
                    colored = mask_and(mask, MaskOf<F>(kind == kRgbEmission));
    if (any(scaled)) {
      const F factor = look_up(kGridEmission, p, scaled, 0);
      e = select(scaled, e * factor, e);
    }
    if (any(colored)) {
      const Vec3<F> shown{look_up(kGridEmission, p, colored, 0), look_up(kGridEmission, p, colored, 1),
                          look_up(kGridEmission, p, colored, 2)};
      e = select(colored, e * shown, e);
    }
    const IntOf<F> colors = integer(kGridColors);
    const MaskOf<F> hot = mask_and(mask, MaskOf<F>(colors >= 0));
    if (any(hot)) {
      const F entry = clamp(look_up(kGridTemperature, p, hot, 0) * number(kGridColorRate), 0.0f,
                            kGridColorCount - 1.001f);
      const IntOf<F> below = to_int(entry);
      const F t = entry - to_float(below);
      const IntOf<F> first = select(hot, colors + below * 3, IntOf<F>{});
      const auto color = [&](int channel) {
        const F a = gather(table_.values.data() + channel, first),
                b = gather(table_.values.data() + channel + 3, first);
        return a + (b - a) * t;
      };
      e = select(hot, e * Vec3<F>{color(0), color(1), color(2)}, e);
    }
    return select(mask, e, Vec3<F>{});
  }

 private:
  F number(int slot) const { return gather(table_.records.data() + slot, record_); }
  int32_t some_own_brick() const {
    const unsigned bits = mask_bits(own_);
    return lane(coefficients_.integer(kFieldFirst), std::countr_zero(bits));
  }
  /// A field of another lattice at a point of normalised space; lanes outside of `mask` read the first one.
  F look_up(int field_slot, const Vec3<F>& p, MaskOf<F> mask, int channel) const {
    const int some = std::countr_zero(mask_bits(mask));
    const FieldLanes<F> field{table_, select(mask, record_, splat_int<F>(lane(record_, some))) + field_slot};
    return field_value<F>(table_, field_cell<F>(field, field.point(p)), channel);
  }

  const VolumeTable& table_;
  MediumRecord<F> medium_;
  Vec3<F> extinction_, scattering_;  // of the medium
  IntOf<F> record_;
  FieldLanes<F> coefficients_;
  MaskOf<F> own_;
  bool any_own_;
  F collides_;
};

}  // namespace lightmill
