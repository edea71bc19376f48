#include "worker/render/pipeline/walks/volume_walk.h"

#include <bit>
#include <limits>
#include <optional>

#include "worker/render/pipeline/walks/lattice_line.h"
#include "worker/render/pipeline/walks/medium_lanes.h"
#include "worker/render/scene/media/grid_lanes.h"

namespace lightmill {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Walks many ways, a lane each. A lane whose way has ended takes the next one: ways differ much in length.
template <bool kPath>
class Walk {
 public:
  Walk(const RenderScene& scene, bool shines, VolumeWays* ways)
      : scene_(scene), ways_(*ways), drawn_(scene.volumes.drawn), shines_(shines) {}

  void run() {
    LaneMask go = splat_mask<Lane>(false);
    for (;;) {
      if (next_ < ways_.size() && kLanes - std::popcount(busy_) >= kRefill) go = refill(go);
      if (!any(go)) return;
      go = advance(go);
      for (unsigned ended = busy_ & ~mask_bits(go); ended; ended &= ended - 1) end(std::countr_zero(ended));
    }
  }

 private:
  /// Lanes are given new ways as soon as so many are free.
  static constexpr int kRefill = 3;

  /// Gives free lanes new ways. `go`: the lanes that are on their way; returns them with the new ones.
  LaneMask refill(LaneMask go) {
    do {
      unsigned fresh_bits = 0;
      for (unsigned free = ~busy_ & 0xffu; free && next_ < ways_.size(); free &= free - 1) {
        const int l = std::countr_zero(free);
        for_each_given(ways_[next_], w_, ToLane{l});
        for_each_found(ways_[next_], w_, ToLane{l});  // nothing yet
        way_of_[l] = next_++;
        fresh_bits |= 1u << l;
      }
      busy_ |= fresh_bits;
      const LaneMask fresh = lanes_of(fresh_bits);
      grids_.emplace(scene_, w_.medium, lanes_of(busy_));
      line_ = LatticeLine(grids_->field().point(w_.origin), grids_->field().direction(w_.direction));
      if constexpr (kPath) share_ = channel_shares(w_.throughput);
      const FieldLanes<Lane>& field = grids_->field();
      bricks_ = bricks_of(field);
      nz_ = field.integer(kFieldBricks + 2);
      last_cell_ = {field.integer(kFieldLast), field.integer(kFieldLast + 1), field.integer(kFieldLast + 2)};
      Lane from;
      clip(&from, &end_);
      const LatticeCell at = brick_at(from, {bricks_.nx - 1, bricks_.ny - 1, nz_ - 1});
      t_ = select(fresh, from, t_);
      b_ = {select(fresh, at.x, b_.x), select(fresh, at.y, b_.y), select(fresh, at.z, b_.z)};
      const LaneMask goes = mask_and(fresh, LaneMask(from < end_));
      for (unsigned ended = fresh_bits & ~mask_bits(goes); ended; ended &= ended - 1)
        end(std::countr_zero(ended));
      go = mask_or(go, goes);
    } while (!any(go) && next_ < ways_.size());
    return go;
  }
  void end(int l) {
    for_each_found(w_, ways_[way_of_[l]], FromLane{l});
    busy_ &= ~(1u << l);
  }
  static LaneMask lanes_of(unsigned bits) {
    LaneInt lanes{};
    for (; bits; bits &= bits - 1) set_lane(&lanes, std::countr_zero(bits), 1);
    return LaneMask(lanes != 0);
  }

  /// Goes on to the next tentative collision or the next brick. Returns the lanes whose way has not ended.
  LaneMask advance(LaneMask go) {
    const Vec3<Lane> exits = line_.exits(b_, kBrick);
    const Lane exit = max(min(least(exits), end_), t_);
    brick_ = select(go, bricks_.first + (b_.z * bricks_.ny + b_.y) * bricks_.nx + b_.x, LaneInt{});
    const Lane majorant = grids_->majorant(brick_);
    const LaneMask tracked = mask_and(go, LaneMask(majorant > 0.0f)),
                   integrated = mask_and(go, LaneMask(majorant < 0.0f));
    const Lane rate = majorant * w_.length, need = rate * (exit - t_);
    const LaneMask tentative = mask_and(tracked, LaneMask(need > w_.left));
    const LaneMask passed = mask_and(tracked, mask_not(tentative));
    w_.left = select(passed, w_.left - need, w_.left);
    t_ = select(tentative, min(t_ + w_.left / select(tentative, rate, splat<Lane>(1.0f)), exit), t_);
    if (any(tentative)) collide(t_, b_, majorant, tentative);
    if (any(integrated)) integrate(t_, exit, b_, integrated);
    go = mask_and(go, LaneMask(w_.collides == 0));
    if constexpr (!kPath) go = mask_and(go, LaneMask(max_component(w_.nulls) > 0.0f));
    const LaneMask leaves = mask_and(go, mask_not(tentative));
    t_ = select(leaves, exit, t_);
    line_.advance(exits, leaves, &b_);
    const auto within = [](LaneInt i, LaneInt n) { return mask_and(LaneMask(i >= 0), LaneMask(i < n)); };
    const LaneMask stays =
        mask_and(mask_and(within(b_.x, bricks_.nx), within(b_.y, bricks_.ny)), within(b_.z, nz_));
    return mask_and(go, mask_or(tentative, mask_and(LaneMask(exit < end_), stays)));
  }

  /// The part of the way within the grid's box.
  void clip(Lane* from, Lane* until) const {
    *from = w_.from, *until = w_.until;
    const Vec3<Lane> lo = grids_->rgb(kGridLo), hi = grids_->rgb(kGridHi);
    const auto slab = [&](Lane o, Lane d, Lane inverse, Lane near, Lane far) {
      const Lane a = (near - o) * inverse, b = (far - o) * inverse;
      const LaneMask along = LaneMask(d == 0.0f), inside = mask_and(LaneMask(o >= near), LaneMask(o <= far));
      const Lane enter =
          select(along, select(inside, splat<Lane>(-kInfinity), splat<Lane>(kInfinity)), min(a, b));
      const Lane leave = select(along, splat<Lane>(kInfinity), max(a, b));
      *from = max(*from, enter);
      *until = min(*until, leave);
    };
    slab(line_.o.x, line_.d.x, line_.inverse.x, lo.x, hi.x);
    slab(line_.o.y, line_.d.y, line_.inverse.y, lo.y, hi.y);
    slab(line_.o.z, line_.d.z, line_.inverse.z, lo.z, hi.z);
  }

  static LaneInt index_of(Lane x, LaneInt least, LaneInt most) {
    return clamp_int<Lane>(to_int(floor(clamp(x, -1.0f, 1e9f))), least, most);
  }
  /// The brick at t; `last`: the one farthest along all axes.
  LatticeCell brick_at(Lane t, const LatticeCell& last) const {
    const Vec3<Lane> p = line_.at(t) * splat<Lane>(1.0f / kBrick);
    return {index_of(p.x, LaneInt{}, last.x), index_of(p.y, LaneInt{}, last.y),
            index_of(p.z, LaneInt{}, last.z)};
  }
  /// The cell at t, within brick b; `last` as above.
  LatticeCell cell_at(Lane t, const LatticeCell& b, const LatticeCell& last) const {
    const Vec3<Lane> p = line_.at(t);
    const auto index = [](Lane x, LaneInt brick, LaneInt last_cell) {
      const LaneInt lo = brick * kBrick, hi = lo + (kBrick - 1);
      return index_of(x, lo, select(LaneMask(last_cell < hi), last_cell, hi));
    };
    return {index(p.x, b.x, last.x), index(p.y, b.y, last.y), index(p.z, b.z, last.z)};
  }
  /// Tentative collisions at t.
  void collide(Lane t, const LatticeCell& b, Lane majorant, LaneMask mask) {
    const MediumCoefficients<Lane> k = grids_->at(in_cell(cell_at(t, b, last_cell_), t, mask));
    const Lane inv = 1.0f / select(mask, majorant, splat<Lane>(1.0f));
    LaneMask real = splat_mask<Lane>(false);
    if constexpr (kPath) {
      if (shines_) {
        const Vec3<Lane> p = point_at(t);
        add_glow(grids_->emission(k, p, mask) * inv, dot(share_, reached()), p, majorant, mask);
      }
      real = mask_and(mask, LaneMask(walk_number(as_uint(w_.seed), w_.drawn) <
                                     component(k.extinction, w_.channel) * inv));
      end_at(real, t, k);
    }
    const LaneMask null = mask_and(mask, mask_not(real));
    const Vec3<Lane> kept = splat3<Lane>(1, 1, 1) - k.extinction * inv;
    w_.nulls = select(null, w_.nulls * non_negative(kept), w_.nulls);
    w_.left = select(null, walk_depth(as_uint(w_.seed), w_.drawn + 1), w_.left);
    w_.drawn = select(mask, w_.drawn + 2, w_.drawn);
  }

  /// Goes through the cells of a brick from t to `exit` without tracking.
  void integrate(Lane t, Lane exit, const LatticeCell& b, LaneMask mask) {
    const LatticeCell& last = last_cell_;
    LatticeCell c = cell_at(t, b, last);
    while (any(mask)) {
      const Vec3<Lane> exits = line_.exits(c, 1);
      const Lane until = max(min(least(exits), exit), t), step = (until - t) * (1.0f / 3);
      MediumCoefficients<Lane> k[4];
      for (int i = 0; i < 4; ++i) k[i] = grids_->at(in_cell(c, t + step * static_cast<float>(i), mask));
      const auto depth = [&](Lane a0, Lane a1, Lane a2, Lane a3) {
        return (a0 + a3 + (a1 + a2) * 3.0f) * (step * w_.length * 0.375f);
      };
      const Vec3<Lane>&e0 = k[0].extinction, &e1 = k[1].extinction, &e2 = k[2].extinction,
            &e3 = k[3].extinction;
      const Vec3<Lane> through{depth(e0.x, e1.x, e2.x, e3.x), depth(e0.y, e1.y, e2.y, e3.y),
                               depth(e0.z, e1.z, e2.z, e3.z)};
      const Lane collides = grids_->collides();
      if constexpr (kPath) {
        const Lane own = component(through, w_.channel) * collides;
        const LaneMask ends = mask_and(mask, LaneMask(own > w_.left));
        if (any(ends)) {
          const Lane s =
              place_of(w_.left / (step * w_.length * 3.0f), component(e0, w_.channel),
                       component(e1, w_.channel), component(e2, w_.channel), component(e3, w_.channel));
          const Lane at = t + (until - t) * s;
          const MediumCoefficients<Lane> there = grids_->at(in_cell(c, at, mask));
          // Up to there, in each channel as in the chosen one.
          const Vec3<Lane> part = partial_depth(s, k, step * w_.length * 3.0f);
          w_.optical = select(ends, w_.optical + part, w_.optical);
          w_.rate = select(ends, w_.rate + part, w_.rate);
          if (shines_) {
            const Vec3<Lane> p = point_at(at);
            add_glow(grids_->emission(there, p, ends), dot(share_, there.extinction * reached()), p,
                     mean(there.extinction), ends);
          }
          end_at(ends, at, there);
          mask = mask_and(mask, mask_not(ends));
        }
        w_.left = select(mask, max(w_.left - own, Lane{}), w_.left);
      }
      w_.optical = select(mask, w_.optical + through, w_.optical);
      w_.rate = select(mask, w_.rate + through * collides, w_.rate);
      t = select(mask, until, t);
      line_.advance(exits, mask, &c);
      const auto stays = [](LaneInt i, LaneInt brick, LaneInt last_cell) {
        const LaneMask in_brick = LaneMask((i >> kBrickBits) == brick);
        return mask_and(in_brick, mask_and(LaneMask(i >= 0), LaneMask(i <= last_cell)));
      };
      mask = mask_and(mask, mask_and(mask_and(stays(c.x, b.x, last.x), stays(c.y, b.y, last.y)),
                                     mask_and(stays(c.z, b.z, last.z), LaneMask(until < exit))));
    }
  }

  /// The cell c at t; of lanes outside of `mask` a cell that exists.
  FieldCell<Lane> in_cell(const LatticeCell& c, Lane t, LaneMask mask) const {
    FieldCell<Lane> found = field_cell<Lane>(bricks_, c.x, c.y, c.z, line_.at(t));
    const int some = std::countr_zero(mask_bits(mask));
    found.brick = select(mask, found.brick, splat_int<Lane>(lane(found.brick, some)));
    found.corner = select(mask, found.corner, LaneInt{});
    return found;
  }
  Vec3<Lane> point_at(Lane t) const { return w_.origin + w_.direction * t; }

  /// The integral from 0 to s of the cubic through values at 0, 1/3, 2/3 and 1.
  struct Cubic {
    Lane a0, a1, a2, a3;
    Cubic(Lane f0, Lane f1, Lane f2, Lane f3)
        : a0(f0),
          a1((18.0f * f1 - 11.0f * f0 - 9.0f * f2 + 2.0f * f3) * (0.5f / 2)),
          a2((2.0f * f0 - 5.0f * f1 + 4.0f * f2 - f3) * (4.5f / 3)),
          a3((3.0f * f1 - f0 - 3.0f * f2 + f3) * (4.5f / 4)) {}
    Lane integral(Lane s) const { return s * (a0 + s * (a1 + s * (a2 + s * a3))); }
  };
  /// Where the integral is `value`.
  static Lane place_of(Lane value, Lane f0, Lane f1, Lane f2, Lane f3) {
    const Cubic cubic(f0, f1, f2, f3);
    Lane lo{}, hi = splat<Lane>(1.0f);
    for (int i = 0; i < 24; ++i) {
      const Lane mid = (lo + hi) * 0.5f;
      const LaneMask before = LaneMask(cubic.integral(mid) < value);
      lo = select(before, mid, lo);
      hi = select(before, hi, mid);
    }
    return (lo + hi) * 0.5f;
  }
  static Vec3<Lane> partial_depth(Lane s, const MediumCoefficients<Lane> k[4], Lane length) {
    const auto one = [&](auto channel) {
      return max(Cubic(channel(k[0]), channel(k[1]), channel(k[2]), channel(k[3])).integral(s) * length,
                 Lane{});
    };
    return {one([](const MediumCoefficients<Lane>& c) { return c.extinction.x; }),
            one([](const MediumCoefficients<Lane>& c) { return c.extinction.y; }),
            one([](const MediumCoefficients<Lane>& c) { return c.extinction.z; })};
  }

  /// P_c so far.
  Vec3<Lane> reached() const { return exp_minus(w_.rate) * w_.nulls; }
  /// Adds what shines at p where a path arrives with `density`; `rate` of the collisions there.
  void add_glow(const Vec3<Lane>& shown, Lane density, const Vec3<Lane>& p, Lane rate, LaneMask mask) {
    mask = mask_and(mask, LaneMask(density > 0.0f));
    const Lane inv = 1.0f / select(mask, density, splat<Lane>(1.0f));
    const Vec3<Lane> all = w_.throughput * exp_minus(w_.optical) * w_.nulls * shown * inv;
    const Lane sum = all.x + all.y + all.z;
    w_.all_glow = select(mask, w_.all_glow + sum, w_.all_glow);
    const Vec3<Lane> way = p - w_.start;
    const Lane passed = mean(reached()) * w_.panes, drawn = gather(drawn_.data(), brick_) * w_.density;
    // M6.
    const Lane hit = rate * passed, next_event = w_.next_event * drawn * (dot(way, way) * w_.stretch2),
               light_paths = w_.light_paths * drawn * passed, others = next_event + light_paths;
    const LaneMask shared = LaneMask(others > 0.0f);
    const Lane inv_all = 1.0f / select(shared, hit + others, splat<Lane>(1.0f));
    const Lane weight = select(shared, hit * inv_all, splat<Lane>(1.0f));
    w_.glow = select(mask, w_.glow + all * weight, w_.glow);
    w_.light_path_glow = select(mask_and(mask, shared), w_.light_path_glow + sum * (light_paths * inv_all),
                                w_.light_path_glow);
  }
  void end_at(LaneMask mask, Lane t, const MediumCoefficients<Lane>& k) {
    w_.collides = select(mask, splat_int<Lane>(1), w_.collides);
    w_.at = select(mask, t, w_.at);
    w_.end_rate = select(mask, k.extinction, w_.end_rate);
    w_.end_scattering = select(mask, k.scattering, w_.end_scattering);
  }

  const RenderScene& scene_;
  VolumeWays& ways_;
  const std::vector<float>& drawn_;
  bool shines_;
  size_t next_ = 0;    // of ways_ to be walked
  unsigned busy_ = 0;  // lanes that have a way, and which
  size_t way_of_[kLanes] = {};

  VolumeWay<Lane> w_;
  std::optional<Grids<Lane>> grids_;
  LatticeLine line_{{}, {}};
  Vec3<Lane> share_{};        // of the channels
  FieldBricks<Lane> bricks_;  // of the grid,
  LaneInt nz_{};              // along z
  LatticeCell last_cell_{};   // the farthest one
  Lane t_{}, end_{};          // where it is, and where it leaves the grid
  LatticeCell b_{};           // the brick there,
  LaneInt brick_{};           // and its number
};

}  // namespace

void walk_through_volumes(const RenderScene& scene, bool shines, VolumeWays* ways) {
  Walk<true>(scene, shines, ways).run();
}

void pass_through_volumes(const RenderScene& scene, VolumeWays* ways) {
  Walk<false>(scene, false, ways).run();
}

}  // namespace lightmill
