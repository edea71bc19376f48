#include "worker/render/pipeline/walks/medium_glow.h"

#include "worker/render/light/direct_sampling.h"
#include "worker/render/pipeline/paths/first_event.h"
#include "worker/render/pipeline/paths/path_radiance.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

void add_glow(int depth, LaneInt slot, LaneMask mask, LaneInt medium, Vec3<Lane> glow, Lane mis,
              FamilyRatios ratios, const StageContext& context, Wavefront& w) {
  if (!any(mask)) return;
  glow = glow * splat<Lane>(context.imaging_ratio);
  const LaneInt group =
      w.groups ? gather(context.scene.medium_groups.data(), select(mask, medium, LaneInt{})) : LaneInt{};
  add_radiance(w, slot, mask, glow, group, lobes_of_hit(w.lobes, slot, depth));
  if (!w.recorder) return;
  add_ratio(&ratios, &FamilyShares::hit, splat<Lane>(1.0f));
  w.recorder->emission(depth + 1, slot, mask, glow, mis, ratios);
}

void add_grid_glow(int depth, LaneInt slot, LaneMask mask, LaneInt medium, const VolumeWay<Lane>& found,
                   Lane dvc, const StageContext& context, Wavefront& w) {
  const Lane weighted = found.glow.x + found.glow.y + found.glow.z;
  const LaneMask shines = mask_and(mask, mask_not(LaneMask(weighted <= 0.0f)));
  const Lane mis = select(shines, weighted / found.all_glow, splat<Lane>(1.0f));
  FamilyRatios ratios{};
  if (w.recorder) {
    const Lane inv = select(LaneMask(weighted > 0x1p-100f), 1.0f / weighted, Lane{});  // else lost anyway
    const Lane light_paths = found.light_path_glow * inv;
    add_ratio(&ratios, &FamilyShares::next_event, max(found.all_glow * inv - 1.0f - light_paths, Lane{}));
    const LaneMask joined = mask_and(shines, LaneMask(dvc > 0.0f));
    w.recorder->add_camera_path(
        slot, select(joined, light_paths / select(joined, dvc, splat<Lane>(1.0f)), Lane{}), dvc, &ratios);
  }
  add_glow(depth, slot, shines, medium, found.glow, mis, ratios, context, w);
}

void compete(const StageContext& context, int depth, LaneMask varies, const PathLanes<Lane>& path,
             VolumeWay<Lane>* way) {
  const RenderScene& scene = context.scene;
  // What the camera sees directly nothing else finds.
  if (depth == 1 || scene.volumes.drawn.empty()) return;
  const LaneInt grid = MediumRecord<Lane>(scene.media.data(), select(varies, path.medium, LaneInt{})).grid();
  const LaneInt record = select(varies, (grid - 1) * kGridFloats, LaneInt{});
  const LaneInt light =
      gather(reinterpret_cast<const int32_t*>(scene.volumes.records.data()) + kGridLight, record);
  const LaneMask shines = mask_and(varies, LaneMask(light >= 0));
  if (!any(shines)) return;
  const LaneInt of = select(shines, light, LaneInt{});
  if (context.on(kNextEvent)) {
    const Lane chosen = direct_selection<Lane>(context.lights, of, way->start, shines);
    way->next_event = select(shines, chosen * path.dvcm, Lane{});
  }
  if (context.on(kLightPaths) && depth - 1 <= kMaxLightVertices) {
    const Lane chosen = LightRecord<Lane>(context.lights, of).scalar(kLightSelect);
    way->light_paths = select(shines, chosen * path.dvc * (1 / (4 * kPi)), Lane{});
  }
}

}  // namespace lightmill
