#pragma once
// The photon guide: sends camera paths where light comes through glass and off mirrors.
//
// From a surface nothing can be joined to a lamp through glass. Unless light paths bring its light, only
// those camera paths find it that happen to leave the surface into the lamp's image. What lies in a mirror or
// behind glass itself light paths can't bring either. A small lamp then makes fireflies, which are nearly all
// the noise there is.
//
// A grid lies over where such light arrives. Each cell has a table of photons that arrived there. Where a
// photon came from is known for its own point and, by the derivative, for the points around it (ray
// differentials: Igehy 1999, "Tracing ray differentials"; of photons: Schjøth et al. 2007, "Photon
// differentials"). So a lamp is found even if it is much smaller than its image moves across the cell. A part
// of the camera paths that leave a surface of a wide lobe go to where one of the photons would have come from
// (Jensen 1995, "Importance driven path tracing using the photon map"), or a little beside it; the rest go by
// the BSDF. Their density is that of both together, for every strategy alike (connections/guided_density.h).
// The guide is filled before rendering (training/photon_guide_training.h) and then fixed: a function of the
// point alone.
#include <bit>
#include <cstdint>
#include <vector>

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/guiding/photon_blocks.h"
#include "worker/render/math/trig.h"

namespace lightmill {

struct PhotonGuide {
  /// A table has photons, all equally likely, in groups of neighbours by direction. It is stored by fields.
  /// Of each photon: its direction as seen from the box's centre, the change of that per step (by rows), and
  /// its spread (GuideLobe). Of each group: axis and least cosine of a cone around all that it may draw.
  /// There are eight cones; those beyond kGroups hold nothing.
  static constexpr int kGroup = 8, kGroups = 4, kLobes = kGroup * kGroups;
  static constexpr int kDirection = 0, kTurn = 3, kSpread = 12, kFields = 13;
  static constexpr int kCones = kFields * kLobes, kTableSize = kCones + 4 * kWidth<Float8>;
  /// The part of camera paths that go by the guide where they leave a surface with a table.
  float share = 0.25f;
  LightGrid grid;
  std::vector<int32_t>
      table_of;                 // per cell of the grid: number of its table, or -1; empty: there is no guide
  std::vector<GuideBox> boxes;  // per table
  std::vector<float> tables;    // kTableSize each
  double gain = 1;  // noise of the image without the guide over that with it, as measured in training

  bool empty() const { return table_of.empty(); }
  /// Density of camera paths where there is a table, from those of the BSDF and of the guide.
  template <class F>
  F mixed(F of_bsdf, F of_guide) const {
    return (1 - share) * of_bsdf + share * of_guide;
  }
  uint64_t bytes() const {
    return sizeof(int32_t) * table_of.capacity() + sizeof(GuideBox) * boxes.capacity() +
           sizeof(float) * tables.capacity();
  }
};

/// Every cell where photons arrived has the table of the smallest block of cells around it with enough of
/// them. Empty if there are too few photons in all.
PhotonGuide make_photon_guide(const std::vector<Photon>& photons);

/// Kinds that scatter so widely that camera paths may leave by the guide. None has a delta lobe: that would
/// be chosen less often then, and makes much of the noise where a lamp is seen in a polished floor.
constexpr bool is_guided(BsdfKind kind) {
  return kind == kDiffuse || kind == kDiffuseTransmission || kind == kRoughCoated ||
         kind == kRoughScatteringCoated || kind == kAnisotropicCoated || is_metallic_roughness(kind) ||
         kind == kPrincipled || kind == kAnisotropicPrincipled || kind == kOrenNayar;
}

/// Paths beside a photon's direction, by the square q of the chord between: q has density K s / (s + q)^2 up
/// to kTail2 s, where s is the photon's spread (an area on the sphere is pi q). So what is far is no firefly.
struct GuideLobe {
  static constexpr float kTail2 = 16, kInside = kTail2 / (1 + kTail2);
  static constexpr float kWidest = 4 / kTail2;  // s of a lobe that is all over the sphere

  /// The direction that `fields` give at `step` from the table's centre.
  template <class F>
  static Vec3<F> direction(const F* fields, const Vec3<F>& step) {
    const F *w = fields + PhotonGuide::kDirection, *t = fields + PhotonGuide::kTurn;
    return normalize(Vec3<F>{w[0] + (t[0] * step.x + t[1] * step.y + t[2] * step.z),
                             w[1] + (t[3] * step.x + t[4] * step.y + t[5] * step.z),
                             w[2] + (t[6] * step.x + t[7] * step.y + t[8] * step.z)});
  }
  template <class F>
  static F chord2(const Vec3<F>& a, const Vec3<F>& b) {
    const Vec3<F> d = a - b;
    return dot(d, d);
  }
  /// Per unit solid angle.
  template <class F>
  static F density(F spread, F chord2) {
    const F all = spread + chord2;
    return select(MaskOf<F>(chord2 < spread * kTail2), spread * (kInvPi / kInside) / (all * all), F{});
  }
};

/// The tables at one point per lane.
template <class F>
struct PhotonGuideTables {
  MaskOf<F> mask;  // lanes that have one

  /// `kind`: of the surface that `p` lies on. If no lane has a table, only `mask` may be read.
  PhotonGuideTables(const PhotonGuide& guide, MaskOf<F> active, IntOf<F> kind, const Vec3<F>& p)
      : guide_(guide) {
    mask = active;
    if (any(mask_and(active, MaskOf<F>(kind != kDiffuse)))) mask = mask_and(active, wide_kinds(kind));
    if (!any(mask)) return;
    table_ = gather(guide.table_of.data(), guide.grid.at<F>(p));
    mask = mask_and(mask, MaskOf<F>(table_ >= 0));
    table_ = select(mask, table_, IntOf<F>{});
    const float* box = guide.boxes.front().centre.data();
    const F half = gather(box + 3, table_ * 4);
    const auto along = [&](F x, int axis) {
      return min(max(x - gather(box + axis, table_ * 4), -half), half);
    };
    step_ = {along(p.x, 0), along(p.y, 1), along(p.z, 2)};
  }

  /// Draws a unit direction by random numbers u and v.
  Vec3<F> draw(F u, F v) const {
    constexpr int kLobes = PhotonGuide::kLobes;
    const IntOf<F> lobe = to_int(min(u * kLobes, splat<F>(kLobes - 1)));
    const F rest = clamp(u * kLobes - to_float(lobe), 0.0f, 1.0f) * GuideLobe::kInside;
    F fields[PhotonGuide::kFields];
    for (int k = 0; k < PhotonGuide::kFields; ++k)
      fields[k] = gather(guide_.tables.data() + k * kLobes, table_ * PhotonGuide::kTableSize + lobe);
    const Frame<F> frame(GuideLobe::direction(fields, step_));
    const F chord2 = fields[PhotonGuide::kSpread] * rest / (1.0f - rest);
    const F r = safe_sqrt(chord2 * (1.0f - 0.25f * chord2));
    F sine, cosine;
    sincos_2pi(v, &sine, &cosine);
    return normalize(frame.to_world({r * cosine, r * sine, 1.0f - 0.5f * chord2}));
  }
  /// Density of the unit direction w, per unit solid angle.
  F density(const Vec3<F>& w) const {
    F result{};
    for (unsigned left = mask_bits(mask); left; left &= left - 1) {
      const int l = std::countr_zero(left);
      const auto vec = [&](const Vec3<F>& x) {
        return splat3<Float8>(lane(x.x, l), lane(x.y, l), lane(x.z, l));
      };
      set_lane(&result, l, density_at(lane(table_, l), vec(step_), vec(w)));
    }
    return result;
  }

 private:
  float density_at(int32_t table, const Vec3<Float8>& step, const Vec3<Float8>& w) const {
    static_assert(PhotonGuide::kGroup == kWidth<Float8>);
    const float* own = guide_.tables.data() + size_t{PhotonGuide::kTableSize} * static_cast<size_t>(table);
    const auto cone = [&](int k) { return load<Float8>(own + PhotonGuide::kCones + k * 8); };
    const Float8 cosine = w.x * cone(0) + w.y * cone(1) + w.z * cone(2);
    Float8 sum{};
    // Most directions that are asked for are those of lamps themselves.
    unsigned left = mask_bits(Int8(cosine >= cone(3)));
    if (!left) return 0;
    for (; left; left &= left - 1) {
      const float* const group = own + std::countr_zero(left) * PhotonGuide::kGroup;
      Float8 fields[PhotonGuide::kFields];
      for (int k = 0; k < PhotonGuide::kFields; ++k)
        fields[k] = load<Float8>(group + k * PhotonGuide::kLobes);
      const Float8 chord2 = GuideLobe::chord2(w, GuideLobe::direction(fields, step));
      sum = sum + GuideLobe::density(fields[PhotonGuide::kSpread], chord2);
    }
    float total = 0;
    for (int l = 0; l < 8; ++l) total += sum[l];
    return total * (1.0f / PhotonGuide::kLobes);
  }
  static MaskOf<F> wide_kinds(IntOf<F> kind) {
    MaskOf<F> wide = splat_mask<F>(false);
    for (unsigned left = (1u << kWidth<F>)-1; left;) {
      const int32_t k = lane(kind, std::countr_zero(left));
      const MaskOf<F> same = MaskOf<F>(kind == k);
      if (is_guided(k)) wide = mask_or(wide, same);
      left &= ~mask_bits(same);
    }
    return wide;
  }

  const PhotonGuide& guide_;
  IntOf<F> table_{};
  Vec3<F> step_;  // from the table's centre
};

}  // namespace lightmill
