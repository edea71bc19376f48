// Vertex connections: camera vertices joined to vertices of light paths (s, t > 1).
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/connections/guided_density.h"
#include "worker/render/pipeline/connections/joined_vertices.h"
#include "worker/render/pipeline/connections/shadow_queue.h"
#include "worker/render/pipeline/shadow_caster.h"

namespace lightmill {
namespace {

template <class K>
void connections(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const int longest = std::min(context.max_depth, kMaxLightVertices) - depth;
  const auto cached = static_cast<int32_t>(w.light_vertices.size());
  if (longest < 1 || cached == 0) return;
  // Systematic sampling of the cache: every step-th vertex from a random start, so that each has probability
  // 1 / step, and the picks of one camera vertex are spread over the depths that the cache is ordered by.
  const float step = static_cast<float>(layer.light_paths) / context.connections;
  const float inv_connections = 1.0f / context.connections;
  for (size_t base = 0; base < w.vertices.size(); base += kLanes) {
    const VertexGroup g(w.vertices, base, context.scene);
    const VertexLanes<Lane>& v = g.v;
    const SampleStream<Lane> stream = layer.camera_stream<Lane>(v.path);
    const Lane start = stream.get_1d(vertex_dim(depth, kDimConnectStart)) * step;
    const Frame<Lane> frame(v.ns);
    const Vec3<Lane> wo = local_viewer(context, v, frame, v.wo);
    for (uint32_t j = 0;; ++j) {
      const LaneInt pick = to_int(start + static_cast<float>(j) * step);
      LaneMask active = mask_and(g.active, LaneMask(pick < cached));
      if (!any(active)) break;
      const LaneInt index = select(active, pick, LaneInt{});
      VertexLanes<Lane> l = load_vertices(w.light_vertices.data(), index);
      l.params.tables = context.scene.bsdf_tables.data();
      active = mask_and(active, LaneMask(l.depth <= longest));
      if (!any(active)) continue;
      const Vec3<Lane> to_light = l.p - v.p;
      const Lane d2 = dot(to_light, to_light);
      const LaneMask apart = LaneMask(d2 > 0.0f);
      const Lane inv_d2 = 1.0f / select(apart, d2, splat<Lane>(1.0f));
      const Vec3<Lane> wi = to_light * sqrt(inv_d2);
      const LaneMask valid =
          mask_and(mask_and(active, apart), mask_and(consistent<K>(v, wi), faces_viewer<K>(l, -wi)));
      const Vec3<Lane> wi_local = frame.to_local(wi);
      BsdfEval<Lane> f =
          eval_bsdf<Lane, K::kSurfaces>(v.kind, valid, v.params, wo, wi_local, Mode::kRadiance);
      f.pdf = camera_density(context.scene, v, wi, valid, f.pdf);
      f.pdf_reverse = reverse_density(context, v, f.pdf_reverse);
      const Frame<Lane> light_frame(l.ns);
      BsdfEval<Lane> fl =
          eval_bsdf<Lane, K::kSurfaces>(l.kind, valid, l.params, light_frame.to_local(l.wo),
                                        local_viewer(context, l, light_frame, -wi), Mode::kImportance);
      if (context.scene.any_shading_normals()) fl.pdf = fl.pdf * viewer_density(l, -wi);
      fl.pdf_reverse = camera_density(context.scene, l, fl.pdf_reverse);
      const Lane cos_v = density_cosine<K>(v, wi), cos_l = density_cosine<K>(l, wi);
      const Lane light_ratio = f.pdf * cos_l * inv_d2, camera_ratio = fl.pdf * cos_v * inv_d2;
      const Lane w_light = light_ratio * (l.dvcm + l.dvc * fl.pdf_reverse);
      const Lane w_camera = camera_ratio * (v.dvcm + v.dvc * f.pdf_reverse);
      // M9, with the number of connections; the contribution is divided by it in turn.
      const Lane mis = mis_weight(w_light * inv_connections, w_camera * inv_connections);
      const Lane geometry =
          inv_connections * shading_cosine<K>(v, abs(wi_local.z)) * adjoint_cosine<K>(l, -wi) * inv_d2;
      Candidates c;
      if constexpr (K::kMedia) {
        c.medium = medium_towards(v, wi), c.ratio = (w_light + w_camera) * inv_connections;
        // The draws after next event's.
        c.seed = hash32(volume_seed(context, stream, vertex_dim(depth, kDimJoinedVolume)) + (j + 1));
      }
      c.value =
          select(valid, v.throughput * l.throughput * f.f * fl.f * (geometry * mis * context.imaging_ratio),
                 Vec3<Lane>{});
      c.origin = offset_origin(v.p, v.error, v.ng, wi);
      c.direction = offset_origin(l.p, l.error, l.ng, -wi) - c.origin;
      c.tfar = splat<Lane>(kSegmentEnd);
      c.target = c.path = v.path;
      c.group = l.group;
      if (const LobedLight* kept = lobes_of<K>(w))
        c.lobes = lobes_of_join(kept, v, valid, wo, wi_local, depth, false);
      const Lane u =
          context.tiny_contribution > 0
              ? stream.get_random(vertex_dim(depth, kDimConnectRoulette + j % kConnectRouletteDims))
              : Lane{};
      if (StrategyRecorder* recorder = recorder_of<K>(w)) {
        FamilyRatios ratios{};
        add_ratio(&ratios, &FamilyShares::connect, splat<Lane>(1.0f));
        recorder->add_stored(false, g.index, v.depth, camera_ratio * inv_connections, v.dvcm, v.dvc,
                             f.pdf_reverse, &ratios);
        recorder->add_stored(true, index, l.depth, light_ratio * inv_connections, l.dvcm, l.dvc,
                             fl.pdf_reverse, &ratios);
        recorder->announce(l.depth + 1, depth + 1, v.path, l.path, mis, ratios);
      }
      queue<K>(context, c, active, context.tiny_contribution, u, false, w);
    }
  }
}

}  // namespace

void shadow_connections(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  with_kernels(context.kernels.joins, w, [&]<class K>(K) { connections<K>(context, layer, depth, w); });
}

}  // namespace lightmill
