#pragma once
// Vertices between memory (one per two cache lines) and lanes.
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

inline constexpr float kUnguided = -1;

/// A vertex per lane.
template <class F>
struct VertexLanes {
  Vec3<F> p, ng, ns, wo, throughput;
  F error{}, dvcm{}, dvc{};
  IntOf<F> kind{}, path{}, depth{};
  IntOf<F> group{};   // of light vertices, with Wavefront::groups: the light group of what they carry
  IntOf<F> unseen{};  // Vertex::kUnseen for a light vertex that is hidden from the camera, else 0
  IntOf<F> media{};   // of its two sides (medium.h); within a medium, that for both
  /// Of light vertices: density of the photon guide towards `wo`, or kUnguided without a table.
  F guide = splat<F>(kUnguided);
  BsdfParams<F> params;
};

namespace vertex_detail {

template <class F>
void to_rows(const VertexLanes<F>& v, F r[32]) {
  auto vec = [&](int slot, const Vec3<F>& a) { r[slot] = a.x, r[slot + 1] = a.y, r[slot + 2] = a.z; };
  vec(Vertex::kP, v.p);
  r[Vertex::kError] = v.error;
  vec(Vertex::kNg, v.ng);
  vec(Vertex::kNs, v.ns);
  vec(Vertex::kWo, v.wo);
  vec(Vertex::kThroughput, v.throughput);
  r[Vertex::kDvcm] = v.dvcm;
  r[Vertex::kDvc] = v.dvc;
  r[Vertex::kKind] = bits_float(as_uint(v.kind));
  r[Vertex::kPathAndDepth] = bits_float(
      as_uint((v.path | v.unseen) + (v.group << Vertex::kGroupShift) + (v.depth << Vertex::kDepthShift)));
  for (int i = 0; i < kBsdfParams; ++i) r[Vertex::kParams + i] = v.params.p[i];
  r[Vertex::kGuide] = v.guide;
  r[Vertex::kMedia] = bits_float(as_uint(v.media));
}

template <class F>
VertexLanes<F> from_rows(const F r[32]) {
  VertexLanes<F> v;
  auto vec = [&](int slot) { return Vec3<F>{r[slot], r[slot + 1], r[slot + 2]}; };
  v.p = vec(Vertex::kP);
  v.error = r[Vertex::kError];
  v.ng = vec(Vertex::kNg);
  v.ns = vec(Vertex::kNs);
  v.wo = vec(Vertex::kWo);
  v.throughput = vec(Vertex::kThroughput);
  v.dvcm = r[Vertex::kDvcm];
  v.dvc = r[Vertex::kDvc];
  v.kind = as_int(float_bits(r[Vertex::kKind]));
  const IntOf<F> both = as_int(float_bits(r[Vertex::kPathAndDepth]));
  v.path = both & (kWavefront - 1);
  v.group = (both & (Vertex::kUnseen - 1)) >> Vertex::kGroupShift;
  v.unseen = both & Vertex::kUnseen;
  v.depth = both >> Vertex::kDepthShift;
  for (int i = 0; i < kBsdfParams; ++i) v.params.p[i] = r[Vertex::kParams + i];
  v.guide = r[Vertex::kGuide];
  v.media = as_int(float_bits(r[Vertex::kMedia]));
  return v;
}

}  // namespace vertex_detail

/// Appends the lanes in `mask`, in lane order.
inline void append_vertices(const VertexLanes<Float8>& v, unsigned mask, std::vector<Vertex>* out) {
  Float8 r[32];
  vertex_detail::to_rows(v, r);
  for (int q = 0; q < 4; ++q) transpose8(r + 8 * q);
  for (int l = 0; l < 8; ++l) {
    if (!(mask >> l & 1)) continue;
    Vertex& w = out->emplace_back();
    for (int q = 0; q < 4; ++q) store(w.f + 8 * q, r[8 * q + l]);
  }
}
inline void append_vertices(const VertexLanes<float>& v, unsigned mask, std::vector<Vertex>* out) {
  if (mask & 1) vertex_detail::to_rows(v, out->emplace_back().f);
}

/// Loads base[index] per lane. Every index must be valid.
inline VertexLanes<Float8> load_vertices(const Vertex* base, Int8 index) {
  Float8 r[32];
  for (int l = 0; l < 8; ++l) {
    const Vertex& v = base[index[l]];
    for (int q = 0; q < 4; ++q) r[8 * q + l] = load<Float8>(v.f + 8 * q);
  }
  for (int q = 0; q < 4; ++q) transpose8(r + 8 * q);
  return vertex_detail::from_rows(r);
}
inline VertexLanes<float> load_vertices(const Vertex* base, int32_t index) {
  return vertex_detail::from_rows(base[index].f);
}

}  // namespace lightmill
