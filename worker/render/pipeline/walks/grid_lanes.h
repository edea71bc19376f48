#pragma once
// Coefficients and emission of media that vary, at points of their grids; a medium per lane.
#include <bit>

#include "worker/render/pipeline/work_items.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

inline Lane component(const Vec3<Lane>& v, LaneInt which) {
  return select(LaneMask(which == 0), v.x, select(LaneMask(which == 1), v.y, v.z));
}
inline Vec3<Lane> non_negative(const Vec3<Lane>& v) {
  return {max(v.x, Lane{}), max(v.y, Lane{}), max(v.z, Lane{})};
}

struct MediumCoefficients {
  Vec3<Lane> extinction, scattering;
  Lane density;  // of a grid with one channel
};

/// The grids of one medium per lane.
class Grids {
 public:
  Grids(const RenderScene& scene, LaneInt medium, LaneMask active)
      : table_(scene.volumes),
        medium_(scene.media.data(), medium),
        record_(select(active, (medium_.grid() - 1) * kGridFloats, LaneInt{})),
        coefficients_{table_, record_ + kGridCoefficients},
        own_(LaneMask(integer(kGridChannels) != 1)),
        any_own_(any(mask_and(active, own_))),
        collides_(medium_.scalar(kMediumCollides)) {}

  const FieldLanes<Lane>& field() const { return coefficients_; }
  Vec3<Lane> rgb(int slot) const { return {number(slot), number(slot + 1), number(slot + 2)}; }
  LaneInt integer(int slot) const {
    return gather(reinterpret_cast<const int32_t*>(table_.records.data()) + slot, record_);
  }
  Lane majorant(LaneInt brick) const { return gather(table_.majorants.data(), brick); }
  /// 1 where paths may end a segment.
  Lane collides() const { return collides_; }

  MediumCoefficients at(const FieldCell<Lane>& c) const {
    const Lane density = field_value<Lane>(table_, c);
    MediumCoefficients k{medium_.rgb(kMediumExtinction) * density, medium_.rgb(kMediumScattering) * density,
                         density};
    if (!any_own_) return k;
    // Lanes with one channel read something that exists, and leave it.
    FieldCell<Lane> own = c;
    own.brick = select(own_, c.brick, splat_int<Lane>(some_own_brick()));
    const auto value = [&](int channel) { return field_value<Lane>(table_, own, channel); };
    const Vec3<Lane> a{value(0), value(1), value(2)}, s{value(3), value(4), value(5)};
    return {select(own_, a + s, k.extinction), select(own_, s, k.scattering), density};
  }

  /// Radiance per unit length at a point of normalised space with these coefficients.
  Vec3<Lane> emission(const MediumCoefficients& k, const Vec3<Lane>& p, LaneMask mask) const {
    const LaneInt kind = integer(kGridEmissionKind);
    mask = mask_and(mask, LaneMask(kind != kNoEmission));
    if (!any(mask)) return {};
    Vec3<Lane> e = medium_.rgb(kMediumEmission);
    e = e * select(own_, non_negative(k.extinction - k.scattering), splat3<Lane>(1, 1, 1) * k.density);
    const LaneMask scaled = mask_and(mask, LaneMask(kind == kScaledEmission)),
                   colored = mask_and(mask, LaneMask(kind == kRgbEmission));
    if (any(scaled)) {
      const Lane factor = look_up(kGridEmission, p, scaled, 0);
      e = select(scaled, e * factor, e);
    }
    if (any(colored)) {
      const Vec3<Lane> shown{look_up(kGridEmission, p, colored, 0), look_up(kGridEmission, p, colored, 1),
                             look_up(kGridEmission, p, colored, 2)};
      e = select(colored, e * shown, e);
    }
    const LaneInt colors = integer(kGridColors);
    const LaneMask hot = mask_and(mask, LaneMask(colors >= 0));
    if (any(hot)) {
      const Lane entry = clamp(look_up(kGridTemperature, p, hot, 0) * number(kGridColorRate), 0.0f,
                               kGridColorCount - 1.001f);
      const LaneInt below = to_int(entry);
      const Lane t = entry - to_float(below);
      const LaneInt first = select(hot, colors + below * 3, LaneInt{});
      const auto color = [&](int channel) {
        const Lane a = gather(table_.values.data() + channel, first),
                   b = gather(table_.values.data() + channel + 3, first);
        return a + (b - a) * t;
      };
      e = select(hot, e * Vec3<Lane>{color(0), color(1), color(2)}, e);
    }
    return select(mask, e, Vec3<Lane>{});
  }

 private:
  Lane number(int slot) const { return gather(table_.records.data() + slot, record_); }
  int32_t some_own_brick() const {
    const unsigned bits = mask_bits(own_);
    return lane(coefficients_.integer(kFieldFirst), std::countr_zero(bits));
  }
  /// A field of another lattice at a point of normalised space; lanes outside of `mask` read the first one.
  Lane look_up(int field_slot, const Vec3<Lane>& p, LaneMask mask, int channel) const {
    const int some = std::countr_zero(mask_bits(mask));
    const FieldLanes<Lane> field{table_,
                                 select(mask, record_, splat_int<Lane>(lane(record_, some))) + field_slot};
    return field_value<Lane>(table_, field_cell<Lane>(field, field.point(p)), channel);
  }

  const VolumeTable& table_;
  MediumRecord<Lane> medium_;
  LaneInt record_;
  FieldLanes<Lane> coefficients_;
  LaneMask own_;
  bool any_own_;
  Lane collides_;
};

}  // namespace lightmill
