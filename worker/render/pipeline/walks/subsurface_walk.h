#pragma once
// Subsurface walks, between stages 3 and 4: from where a path enters a body to where it leaves. Scenes
// without such a material never come here.
//
// A walk is a chain of segments in a homogeneous medium, between collisions and diffuse reflections by the
// inside of the boundary, until one of those that meet the boundary leaves (bsdf/subsurface.h). Its vertices
// are no vertices of the path: they are not stored, and no strategy joins two of them. The whole walk, entry
// and exit included, is one scattering event, as in pbrt.
//
// The boundary is whatever has the material that was entered. Other surfaces do not stop a walk. Outside is
// the side that the path came from: a body may be an open sheet, and normals may point either way. Where the
// boundary is met from outside, as another ball of that material is, the walk goes in there, too, and passes
// through one more boundary on its way out: what overlaps is one body. Only so are there as many ways from x
// to y as back, which MIS relies on.
//
// Sampling. As in medium_walk.h, a segment is drawn from the mean free path of a channel, chosen in
// proportion to the throughput. Segments are weighted by the density over all channels, so the sum of the
// channels never grows. Whatever the weights are, roulette keeps the walk short: it takes what has lost most
// of its throughput, and from some K on a walk gets to step n with probability sqrt(K / n) at most. In a deep
// body that absorbs nothing it gets there with n^-1/2 anyway. With both, the number of steps and the second
// moment of the weight grow like log n only.
//
// MIS (mis.h). The density of a walk from x to y is that from y to x: it cancels. That counts every factor
// that the two directions share: steps, reflections, the Lambertian cosines at both ends, with the mean over
// channels for the weights that depend on the throughput. What is left of a walk is an edge that no strategy
// makes by itself, between a vertex x where the path enters with probability P(wo) and one y where it leaves:
//   dVC(y) = (dVC(x) pdf_rev(x) + dVCM(x)) / P(wo)     dVCM(y) = 0                                  (M11)
// That is M4 with P for the density and without a cosine, while M3 does nothing. At y pdf_rev is the
// probability of entering there. So y goes on as any vertex does.
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/vertex_io.h"

namespace lightmill {

struct BodyWalks {
  // Of the walk of a path slot. The ray and the throughput are in Wavefront::paths.
  alignas(32) float outside[kWavefront];     // 1 if the geometric normal points outside, -1 if inside
  alignas(32) float before[kWavefront];      // the largest channel of the throughput at the entry
  alignas(32) float albedo[3][kWavefront];   // of a collision
  alignas(32) float collisions[kWavefront];  // so far
  alignas(32) float left[kWavefront];        // of the segment: way to the collision; negative: not drawn yet
  alignas(32) float gone[kWavefront];        // and way so far, through surfaces that are not the boundary
  alignas(32) int32_t within[kWavefront];    // boundaries that were met from outside, less those met again
  alignas(32) int32_t body[kWavefront];      // number of its record
  alignas(32) int32_t boundary[kWavefront];  // material of its surface: perhaps a mix with the body's

  std::vector<int32_t> walking;  // slots in a body, in the order in which they entered
  std::vector<int32_t> leaving;  // slots whose ray ends where they leave, in the order in which they do
  std::vector<int32_t> next;     // of `walking`, for the step after this
};

/// Lanes `enters` of the vertices `v`, on primitives `prim`, go on inside with the throughput and dVC of
/// `carried` (M11).
void enter_bodies(const StageContext& context, const SampleStream<Lane>& stream, int depth,
                  const VertexLanes<Lane>& v, LaneInt prim, PathLanes<Lane> carried, LaneMask enters,
                  Wavefront& w);

/// Factor for the throughput of walks that have left where `albedo`, at the point where they left, differs
/// from the one that they entered with. A walk with n collisions has (a b)^(n/2), where a and b are the
/// albedos below its ends: the same both ways.
Vec3<Lane> albedo_from_both_ends(const BodyWalks& walks, LaneInt slot, const Vec3<Lane>& albedo);

/// Walks all paths that have entered until each leaves or is lost.
void walk_through_bodies(const StageContext& context, const LayerContext& layer, bool light, int depth,
                         Wavefront& w);

}  // namespace lightmill
