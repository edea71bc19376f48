#include "worker/render/pipeline/recording/aov_recorder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/film/signed_sum.h"
#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/pipeline/recording/motion_vectors.h"
#include "worker/render/pipeline/recording/surface_albedo.h"
#include "worker/render/renderer.h"

namespace lightmill {
namespace {

void store_lanes(float out[3][kWavefront], LaneInt slot, LaneMask mask, const Vec3<Lane>& value) {
  scatter(out[0], slot, value.x, mask);
  scatter(out[1], slot, value.y, mask);
  scatter(out[2], slot, value.z, mask);
}

bool is_holdout(const VertexLanes<Lane>& v, int l) {
  const float reflectance = lane(v.params.p[0], l);
  return lane(v.kind, l) == kDiffuse && reflectance == 0 && std::signbit(reflectance);
}

/// Distance of a point of normalised space along the viewing direction; from the camera if it has none.
Lane depth_of_point(const Camera& camera, const Vec3<Lane>& p) {
  const float* forward = nullptr;
  if (const auto* pinhole = std::get_if<PerspectiveCamera>(&camera)) forward = pinhole->forward;
  if (const auto* lens = std::get_if<ThinLensCamera>(&camera)) forward = lens->pinhole.forward;
  if (const auto* parallel = std::get_if<OrthographicCamera>(&camera)) forward = parallel->forward;
  if (const auto* lens = std::get_if<ParallelLensCamera>(&camera)) forward = lens->window.forward;
  return forward ? p.x * forward[0] + p.y * forward[1] + p.z * forward[2] : sqrt(dot(p, p));
}

}  // namespace

void AovRecorder::begin_packet() {
  for (int layer = 0; layer < kAovLayers; ++layer) {
    if (has_layer(spec_, layer)) sums_[static_cast<size_t>(layer)].assign(kCellPixels, {});
  }
  direct_splats_.clear();
  groups_.begin_packet();
  lobes_.begin_packet();
  mattes_.begin_packet();
}

void AovRecorder::begin_layer(const Wavefront& w) {
  std::copy_n(w.slots.weight, kWavefront, weight_);
  groups_.begin_pass();
  lobes_.begin_pass();
  std::memset(albedo_, 0, sizeof albedo_);
  std::memset(diffuse_, 0, sizeof diffuse_);
  std::memset(normal_, 0, sizeof normal_);
  std::memset(motion_, 0, sizeof motion_);
  std::memset(direct_, 0, sizeof direct_);
  std::memset(hit_, 0, sizeof hit_);
  std::memset(surface_found_, 0, sizeof surface_found_);
}

void AovRecorder::hits(const StageContext& context, const Hit& hit, LaneMask active, int depth,
                       const Paths& paths) {
  const VertexLanes<Lane>& v = hit.v;
  if (depth == 1) {
    scatter(uv_[0], v.path, hit.u, active);
    scatter(uv_[1], v.path, hit.tv, active);
    store_lanes(position_, v.path, active, v.p);
    const CameraMotion& motion = context.scene.camera_motion;
    const Vec3<Lane> p = motion.moves ? motion.at_rest(v.p, gather(paths.time, v.path)) : v.p;
    if (spec_.set & kAovMotion && context.scene.moves()) {
      const auto moved = motion_on_film(context, hit, active, gather(paths.time, v.path));
      scatter(motion_[0], v.path, moved[0], active);
      scatter(motion_[1], v.path, -moved[1], active);
    }
    scatter(depth_, v.path, depth_of_point(context.camera, p), active);
  }
  const LaneMask opaque = mask_and(active, mask_not(pure_delta<Lane>(v.kind)));
  int32_t found[kLanes] = {};
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const auto slot = static_cast<size_t>(lane(v.path, l));
    // A path that has scattered in a medium meets its first surface later: it has no depth and no position.
    if (depth == 1 && !is_holdout(v, l)) {
      hit_[slot] = 1;
      // Coverage is a part of alpha, so counts are of what makes a sample count for it.
      if (spec_.set & kAovsOfCounts)
        mattes_.hit(slot, context.scene.matte_key_of(paths.rays[slot].prim, paths.rays[slot].instance));
    }
    if (!(mask_bits(opaque) >> l & 1) || surface_found_[slot]) continue;
    surface_found_[slot] = 1;
    found[l] = 1;
  }
  const LaneMask first = LaneMask(load_int<Lane>(found) > 0);
  if (!any(first) || !wants_surfaces()) return;
  const LaneMask away = LaneMask(dot(v.ns, v.wo) < 0.0f);
  store_lanes(normal_, v.path, first, select(away, -v.ns, v.ns));
  if (!wants_albedo()) return;
  Vec3<Lane> diffuse{};
  const bool split = needs_layer(spec_.set, kDiffuseAlbedoLayer);
  const Vec3<Lane> albedo = albedo_at(context.scene, v, first, split ? &diffuse : nullptr);
  store_lanes(albedo_, v.path, first, albedo * v.throughput);
  if (split) store_lanes(diffuse_, v.path, first, diffuse * v.throughput);
}

void AovRecorder::ends_in_medium(LaneInt slot, LaneMask active) {
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1)
    surface_found_[lane(slot, std::countr_zero(bits))] = 1;
}

bool AovRecorder::first_hits_done(const Paths& paths) const {
  if (!wants_surfaces()) return true;
  for (int i = 0; i < paths.active_count; ++i) {
    if (!surface_found_[paths.active[i]]) return false;
  }
  return true;
}

void AovRecorder::direct_so_far(const Wavefront& w) {
  std::memcpy(direct_[0], w.radiance_r, sizeof direct_[0]);
  std::memcpy(direct_[1], w.radiance_g, sizeof direct_[1]);
  std::memcpy(direct_[2], w.radiance_b, sizeof direct_[2]);
}

void AovRecorder::begin_indirect(const Wavefront& w) {
  std::memcpy(before_[0], w.radiance_r, sizeof before_[0]);
  std::memcpy(before_[1], w.radiance_g, sizeof before_[1]);
  std::memcpy(before_[2], w.radiance_b, sizeof before_[2]);
}

void AovRecorder::end_direct(const Wavefront& w) {
  const float* now[3] = {w.radiance_r, w.radiance_g, w.radiance_b};
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < kWavefront; ++i) direct_[c][i] += now[c][i] - before_[c][i];
  }
}

void AovRecorder::direct_splats(std::span<const Splat> splats) {
  direct_splats_.insert(direct_splats_.end(), splats.begin(), splats.end());
}

void AovRecorder::finish_layer(const StageContext& context, int quantum_exponent, const Wavefront& w) {
  const Aovs set = spec_.set;
  for (size_t i = 0; i < kWavefront; ++i) {
    if (!w.slots.taken[i]) continue;
    const auto pixel = static_cast<size_t>(w.slots.pixel[i]);
    const auto times = spec_.weighted ? static_cast<Units>(weight_[i] * kWeightOne) : Units{1};
    if (spec_.weighted) {
      sums_[kWeightsLayer][pixel].c[0] += times;
      sums_[kWeightsLayer][pixel].c[1] += 1;
    }
    for (size_t c = 0; c < 3; ++c) {
      const Units albedo = albedo_units(albedo_[c][i]);
      if (needs_layer(set, kAlbedoLayer)) sums_[kAlbedoLayer][pixel].c[c] += times * albedo;
      if (needs_layer(set, kDiffuseAlbedoLayer))
        sums_[kDiffuseAlbedoLayer][pixel].c[c] += times * std::min(albedo, albedo_units(diffuse_[c][i]));
      if (set & kAovNormal) sums_[kNormalLayer][pixel].c[c] += times * normal_units(normal_[c][i]);
      if (hit_[i] && (set & kAovPosition))
        sums_[kPositionLayer][pixel].c[c] += times * position_units(position_[c][i]);
    }
    if (hit_[i] && needs_layer(set, kDepthLayer)) {
      sums_[kDepthLayer][pixel].c[0] += times * depth_units(depth_[i]);
      sums_[kDepthLayer][pixel].c[1] += times;
    }
    if (hit_[i] && (set & kAovUv)) {
      for (size_t c = 0; c < 2; ++c) sums_[kUvLayer][pixel].c[c] += times * uv_units(uv_[c][i]);
      sums_[kUvLayer][pixel].c[2] += times;
    }
    if (hit_[i] && (set & kAovMotion)) {
      for (size_t c = 0; c < 2; ++c) sums_[kMotionLayer][pixel].c[c] += times * motion_units(motion_[c][i]);
      sums_[kMotionLayer][pixel].c[2] += times;
    }
    if (hit_[i] && (set & kAovsOfCounts)) mattes_.add(pixel, i, static_cast<uint64_t>(times));
    float radiance[3] = {w.radiance_r[i], w.radiance_g[i], w.radiance_b[i]};
    float direct_light[3] = {direct_[0][i], direct_[1][i], direct_[2][i]};
    if (context.response) context.response->mix(&direct_light[0], &direct_light[1], &direct_light[2]);
    for (size_t c = 0; c < 3; ++c) radiance[c] *= w.slots.weight[i], direct_light[c] *= w.slots.weight[i];
    const auto units = [&](float x) {
      return context.signed_film ? to_signed_units(x, quantum_exponent) : to_units(x, quantum_exponent);
    };
    // What the film drops is dropped here, too, so that direct light stays a part of the whole.
    const auto r = units(radiance[0]), g = units(radiance[1]), b = units(radiance[2]);
    if (!r || !g || !b) continue;
    if (w.groups) groups_.add_sample(context, quantum_exponent, w, i, {*r, *g, *b});
    if (w.lobes) lobes_.add_sample(context, quantum_exponent, w, i, {*r, *g, *b});
    for (size_t c = 0; c < 3; ++c) {
      if (wants_direct()) {
        const auto direct = units(std::min(direct_light[c], radiance[c]));
        sums_[kDirectLayer][pixel].c[c] += direct.value_or(0);
      }
      if (set & kAovVariance)
        sums_[kVarianceLayer][pixel].c[c] += times * square_units(radiance[c] / weight_[i], quantum_exponent);
    }
  }
}

void AovRecorder::finish_packet(const Packet& packet, const RenderScene& scene, PartialBuilder& builder) {
  for (int layer = 0; layer < kAovLayers; ++layer) {
    const std::vector<ExactRgb>& sums = sums_[static_cast<size_t>(layer)];
    if (!has_layer(spec_, layer)) continue;
    builder.add_aov(layer, packet.cell_x, packet.cell_y, std::span<const ExactRgb, kCellPixels>(sums));
  }
  if (spec_.set & kAovsOfCounts)
    builder.add_mattes(packet.cell_x, packet.cell_y, mattes_.cell(), scene.mattes.list());
  if (!direct_splats_.empty()) builder.add_direct_splats(direct_splats_);
  groups_.finish_packet(packet, builder);
  lobes_.finish_packet(packet, builder);
}

}  // namespace lightmill
