#include "worker/render/pipeline/connections/volume_light_sampling.h"

#include <algorithm>
#include <bit>

#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/walks/straight_line.h"
#include "worker/render/sampling/dimensions.h"
#include "worker/render/scene/media/grid_lanes.h"

namespace lightmill {
namespace {

/// A brick of the light in proportion to what leaves it. `more` extends `u`: bricks may be millions.
size_t choose_brick(const VolumeLight& light, float u, float more) {
  const auto count = static_cast<double>(light.bricks.size());
  const double x = (double{u} + 0x1p-24 * double{more}) * count;
  const size_t column = std::min(static_cast<size_t>(x), light.bricks.size() - 1);
  const bool own = x - static_cast<double>(column) < double{light.keep[column]};
  return own ? column : static_cast<size_t>(light.alias[column]);
}

/// Points of bricks, by lane.
struct BrickPoints {
  float at[3][kLanes] = {};     // in cell coordinates
  float place[3][kLanes] = {};  // in the box of the light's record
  int32_t cell[3][kLanes] = {};
  int32_t medium[kLanes] = {};  // 0: not a volume light
};

/// Draws points of the lights of the lanes in `ours`: the brick by `pick` and `more`, the place in it by `u`.
BrickPoints draw_places(const RenderScene& scene, LaneInt of, LaneMask ours, Lane pick, Lane more,
                        const Lane (&u)[3]) {
  BrickPoints points;
  for (unsigned bits = mask_bits(ours); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const VolumeLight& light = *std::find_if(scene.lights.volumes.begin(), scene.lights.volumes.end(),
                                             [&](const VolumeLight& v) { return v.light == lane(of, l); });
    const size_t medium = static_cast<size_t>(light.medium) * kMediumFloats;
    const auto grid = static_cast<size_t>(std::bit_cast<int32_t>(scene.media[medium + kMediumGrid]) - 1);
    const float* const record = scene.volumes.records.data() + grid * kGridFloats;
    const auto& brick = light.bricks[choose_brick(light, lane(pick, l), lane(more, l))];
    points.medium[l] = light.medium;
    for (size_t i = 0; i < 3; ++i) {
      const BrickSide side(record, i, brick[i]);
      const float at = side.from + (side.until - side.from) * lane(u[i], l);
      points.at[i][l] = at;
      points.cell[i][l] = std::clamp(static_cast<int32_t>(at), side.first_cell, side.last_cell);
      points.place[i][l] = (at - light.first[i]) / light.cells[i];
    }
  }
  return points;
}

/// Points on lights that are grids.
struct VolumePoints {
  LaneInt medium;
  Vec3<Lane> p;         // as the light is at the time
  Vec3<Lane> emission;  // radiance per unit length
  Lane rate, inv_rate;  // m above, and 1 / m, or 0
  Lane density;         // per unit volume, given the light

  VolumePoints(const RenderScene& scene, LaneInt of, LaneMask ours, Lane time, Lane pick, Lane more,
               const Lane (&u)[3]) {
    const BrickPoints points = draw_places(scene, of, ours, pick, more, u);
    const auto lanes = [](const float(*rows)[kLanes]) {
      return Vec3<Lane>{load<Lane>(rows[0]), load<Lane>(rows[1]), load<Lane>(rows[2])};
    };
    medium = load_int<Lane>(points.medium);
    const Vec3<Lane> place = lanes(points.place);
    LightRecord<Lane> r(scene.lights, of);
    const auto in_box = [&] {
      return r.vec(kLightP) + r.vec(kLightE1) * place.x + r.vec(kLightE2) * place.y +
             r.vec(kLightN) * place.z;
    };
    const auto volume = [&] { return abs(dot(cross(r.vec(kLightE1), r.vec(kLightE2)), r.vec(kLightN))); };
    const Vec3<Lane> at_rest = in_box();
    p = at_rest;
    const Grids<Lane> grids(scene, medium, ours);
    FieldCell<Lane> cell =
        field_cell<Lane>(bricks_of(grids.field()), load_int<Lane>(points.cell[0]),
                         load_int<Lane>(points.cell[1]), load_int<Lane>(points.cell[2]), lanes(points.at));
    const int some = std::countr_zero(mask_bits(ours));
    cell.brick = select(ours, cell.brick, splat_int<Lane>(lane(cell.brick, some)));
    cell.corner = select(ours, cell.corner, LaneInt{});
    const MediumCoefficients<Lane> k = grids.at(cell);
    const Lane majorant = grids.majorant(cell.brick);
    const Lane mean = (k.extinction.x + k.extinction.y + k.extinction.z) * (1.0f / 3);
    rate = select(LaneMask(majorant > 0.0f), majorant, mean);
    inv_rate = select(LaneMask(rate > 0.0f), 1.0f / rate, Lane{});
    emission = select(LaneMask(rate > 0.0f), grids.emission(k, at_rest, ours), Vec3<Lane>{});
    density = gather(scene.volumes.drawn.data(), cell.brick);
    if (scene.lights.any_moving()) {
      const Lane first = volume();
      r.move_to(scene.lights, of, time);
      p = in_box();
      density = density * (first / volume());
    }
  }
};

/// Whether there is `medium` at p, by what is met in direction d.
bool is_in_medium(const StageContext& context, int32_t medium, const Vec3<float>& p, const Vec3<float>& d,
                  float time) {
  int32_t here = context.scene.outer_medium;
  for_each_transition(context.scene, context.accel, p, d, time, [&](int32_t near, int32_t) {
    here = near;
    return false;
  });
  return here == medium;
}

}  // namespace

LaneInt sample_volume_lights(const StageContext& context, const Vec3<Lane>& reference,
                             const SampleStream<Lane>& stream, int depth, LaneMask active, Lane time,
                             DirectSample<Lane>* d) {
  const LaneMask ours = volume_lanes(context.lights, d->light, active);
  if (!any(ours)) return LaneInt{};
  const Lane pick = stream.get_1d(vertex_dim(depth, kDimJoinedVolume)),
             more = stream.get_random(vertex_dim(depth, kDimNeeTexel));
  Lane u[3];
  stream.get_2d(vertex_dim(depth, kDimVolume), &u[0], &u[1]);
  u[2] = stream.get_1d(vertex_dim(depth, kDimNeeTexel));
  const VolumePoints v(context.scene, d->light, ours, time, pick, more, u);
  const Vec3<Lane> to = v.p - reference;
  const Lane distance2 = dot(to, to);
  const LaneMask apart = mask_and(ours, LaneMask(distance2 > 0.0f));
  const Vec3<Lane> wi = to * (1.0f / sqrt(select(apart, distance2, splat<Lane>(1.0f))));
  d->point = select(ours, v.p, d->point);
  d->wi = select(ours, wi, d->wi);
  d->normal = select(ours, -wi, d->normal);
  d->distance2 = select(ours, distance2, d->distance2);
  d->radiance = select(ours, select(apart, v.emission * v.inv_rate, Vec3<Lane>{}), d->radiance);
  d->pdf = select(ours, d->selection * v.density * distance2 * v.inv_rate, d->pdf);
  const Lane selected = LightRecord<Lane>(context.lights, d->light).scalar(kLightSelect);
  d->pdf_emission = select(ours, selected * v.density * (1 / (4 * kPi)), d->pdf_emission);
  d->cos_light = select(ours, select(LaneMask(v.rate > 0.0f), v.rate, splat<Lane>(1.0f)), d->cos_light);
  d->error = select(ours, Lane{}, d->error);
  return v.medium;
}

void sample_volume_emission(const StageContext& context, const SampleStream<Lane>& stream, Lane pu, Lane pv,
                            Lane du, Lane dv, const float* times, LaneMask active, EmissionSample<Lane>* e) {
  const RenderScene& scene = context.scene;
  const LaneMask ours = volume_lanes(context.lights, e->light, active);
  if (!any(ours)) return;
  const Lane u[3] = {pu, pv, stream.get_1d(vertex_dim(0, kDimVolume))};
  const VolumePoints v(scene, e->light, ours, times ? load<Lane>(times) : Lane{},
                       stream.get_1d(kDimLightTexel), stream.get_random(kDimLightTexel), u);
  const Vec3<Lane> w = square_to_sphere(du, dv);
  const Lane selected = LightRecord<Lane>(context.lights, e->light).scalar(kLightSelect);
  const Lane pdf = selected * (1 / (4 * kPi));
  LaneMask shines = mask_and(ours, LaneMask(v.density > 0.0f));
  for (unsigned bits = mask_bits(shines); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const auto of = [&](const Vec3<Lane>& x) {
      return Vec3<float>{lane(x.x, l), lane(x.y, l), lane(x.z, l)};
    };
    if (!is_in_medium(context, lane(v.medium, l), of(v.p), of(w), times ? times[l] : 0))
      set_lane(&shines, l, 0);
  }
  const Lane inv_density = 1.0f / select(shines, v.density, splat<Lane>(1.0f));
  e->point = select(ours, v.p, e->point);
  e->direction = select(ours, w, e->direction);
  e->normal = select(ours, w, e->normal);
  e->error = select(ours, Lane{}, e->error);
  e->power = select(ours, select(shines, v.emission * (inv_density / pdf), Vec3<Lane>{}), e->power);
  e->pdf = select(ours, pdf, e->pdf);
  e->cos_light = select(ours, v.rate * inv_density, e->cos_light);
}

}  // namespace lightmill
