#pragma once
// Where light comes through glass and off mirrors, so that camera paths go there. From a surface nothing can
// be joined to a lamp through glass: unless light paths bring it, its light is met by those camera paths
// alone that happen to leave the surface into the lamp's image. What lies in a mirror or behind glass itself
// light paths can't bring either, and a small lamp then makes fireflies of nearly all the noise there is.
//
// A grid lies over where such light arrives, and a cell has a table of its directions, over a window of the
// sphere that holds them all. A part of the camera paths that leave a surface of a wide lobe there go by the
// table (Jensen 1995, "Importance driven path tracing using the photon map"), the rest by the BSDF; their
// density is that of both together, for every strategy alike (pipeline/guided_density.h). It is filled before
// rendering (plan/caustic_learning.h) and fixed then: a function of the point alone.
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/light/light_aim.h"
#include "worker/render/light/light_guide.h"

namespace lightmill {

/// The directions of a table: a rectangle of the square [-1, 1]^2 of the sphere (sphere_to_square), and a
/// cone that holds it.
struct GuideWindow {
  float x0 = -1, x1 = 1, y0 = -1, y1 = 1;
  std::array<float, 3> axis{0, 0, 1};
  float least_cosine = -2;  // -2: all directions
};
static_assert(sizeof(GuideWindow) == 8 * sizeof(float));

struct CausticGuide {
  /// A table is a tree that halves its window 2^kLevels-fold, across x and y by turns. All leaves are equally
  /// likely, so that they are small where light is bright.
  static constexpr int kLevels = 6;
  static constexpr int32_t kNodes = 1 << kLevels;
  /// Of which a table is made at least.
  static constexpr size_t kLeastPhotons = 64;
  /// Of the camera paths that leave a surface where there is a table.
  float share = 0.25f;
  LightGrid grid;
  std::vector<int32_t>
      table_of;  // per cell of the grid: number of its table, or -1; empty: there is no guide
  std::vector<GuideWindow> windows;  // per table
  std::vector<float> splits;         // per table and node; the root is 1, the halves of i are 2 i and 2 i + 1
  double gain = 1;  // noise of the image without the guide over that with it, as far as was learnt

  bool empty() const { return table_of.empty(); }
  /// Density of camera paths where there is a table, by those of the BSDF and of the guide.
  template <class F>
  F mixed(F of_bsdf, F of_guide) const {
    return (1 - share) * of_bsdf + share * of_guide;
  }
  uint64_t bytes() const {
    return sizeof(int32_t) * table_of.capacity() + sizeof(GuideWindow) * windows.capacity() +
           sizeof(float) * splits.capacity();
  }
};

/// Where a light path came to a wide lobe from mirrors and glass alone.
struct Photon {
  Vec3f p;
  float x = 0, y = 0;  // of the direction to where it came from, on the square [-1, 1]^2 of the sphere
  float power = 0;
};

/// Every cell that photons came to has the table of the smallest block of cells around it with enough of
/// them. Empty if there are too few of all.
CausticGuide make_caustic_guide(const std::vector<Photon>& photons);

/// Kinds that scatter so widely that camera paths may leave by the guide. None has a delta lobe: that would
/// be chosen less often then, and is much of the noise where a lamp is seen in a polished floor.
constexpr bool is_guided(BsdfKind kind) {
  return kind == kDiffuse || kind == kDiffuseTransmission || kind == kRoughCoated ||
         kind == kRoughScatteringCoated || kind == kAnisotropicCoated || is_metallic_roughness(kind);
}

/// The tables at a point per lane.
template <class F>
struct GuideTables {
  MaskOf<F> mask;  // lanes that have one

  /// `kind`: of the surface that `p` lies on. Unless a lane has a table, nothing else is to be asked.
  GuideTables(const CausticGuide& guide, MaskOf<F> active, IntOf<F> kind, const Vec3<F>& p) : guide_(guide) {
    mask = active;
    if (any(mask_and(active, MaskOf<F>(kind != kDiffuse)))) mask = mask_and(active, wide_kinds(kind));
    if (!any(mask)) return;
    table_ = gather(guide.table_of.data(), guide.grid.at<F>(p));
    mask = mask_and(mask, MaskOf<F>(table_ >= 0));
    table_ = select(mask, table_, IntOf<F>{});
    load_octets(&guide.windows.front().x0, table_ * 8, window_);
  }

  /// A unit direction by random numbers u and v.
  Vec3<F> draw(F u, F v) const {
    Leaf leaf = window();
    descend(&leaf, [&](int level, F) {
      F& r = level % 2 == 0 ? u : v;
      const MaskOf<F> upper = MaskOf<F>(r >= 0.5f);
      r = 2.0f * r - select(upper, splat<F>(1.0f), F{});
      return upper;
    });
    const F x = leaf.x0 + u * (leaf.x1 - leaf.x0), y = leaf.y0 + v * (leaf.y1 - leaf.y0);
    return equal_area_square_to_sphere(0.5f * x + 0.5f, 0.5f * y + 0.5f);
  }
  /// Density of the unit direction w, per unit solid angle.
  F density(const Vec3<F>& w) const {
    // Most directions that are asked for are those of lamps themselves.
    const F cosine = w.x * window_[4] + w.y * window_[5] + w.z * window_[6];
    if (!any(mask_and(mask, MaskOf<F>(cosine >= window_[7])))) return F{};
    F x, y;
    sphere_to_square(w, &x, &y);
    Leaf leaf = window();
    const MaskOf<F> inside = mask_and(mask_and(MaskOf<F>(x >= leaf.x0), MaskOf<F>(x <= leaf.x1)),
                                      mask_and(MaskOf<F>(y >= leaf.y0), MaskOf<F>(y <= leaf.y1)));
    if (!any(mask_and(mask, inside))) return F{};
    descend(&leaf, [&](int level, F split) { return MaskOf<F>((level % 2 == 0 ? x : y) >= split); });
    constexpr float kLeaves = CausticGuide::kNodes;
    return select(inside, kInvPi / (kLeaves * (leaf.x1 - leaf.x0) * (leaf.y1 - leaf.y0)), F{});
  }

 private:
  struct Leaf {
    F x0, x1, y0, y1;
  };
  Leaf window() const { return {window_[0], window_[1], window_[2], window_[3]}; }
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
  /// Narrows `leaf` down to one; upper(level, split): which lanes go to the upper half.
  template <class Upper>
  void descend(Leaf* leaf, Upper&& upper) const {
    IntOf<F> node = splat_int<F>(1);
    for (int level = 0; level < CausticGuide::kLevels; ++level) {
      const F split = gather(guide_.splits.data(), table_ * CausticGuide::kNodes + node);
      const MaskOf<F> above = upper(level, split);
      F &lo = level % 2 == 0 ? leaf->x0 : leaf->y0, &hi = level % 2 == 0 ? leaf->x1 : leaf->y1;
      lo = select(above, split, lo);
      hi = select(above, hi, split);
      node = 2 * node + select(above, splat_int<F>(1), IntOf<F>{});
    }
  }

  const CausticGuide& guide_;
  IntOf<F> table_{};
  F window_[8];  // GuideWindow
};

}  // namespace lightmill
