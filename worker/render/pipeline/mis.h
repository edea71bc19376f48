#pragma once
// Multiple importance sampling over every (s,t) strategy: the scheme, stated once.
//
// A path of n = s + t vertices can be made by s light and t camera vertices. The strategies are:
//   s = 0        unidirectional hit: a camera path meets an emitter or escapes to the environment
//   s = 1        next-event estimation: a camera vertex samples a point on a light
//   s >= 2, t >= 2  vertex connection, to vertices drawn from the light-vertex cache of the packet's layer
//   t = 1        light tracing: a light vertex is joined to the camera and splatted
// t = 0, a light path that hits the lens, is never sampled, not with a finite lens either. It has no term
// (dVC = 0 in M2).
//
// The weight of strategy i is the balance heuristic w_i = n_i p_i / sum_j n_j p_j (Veach 1997, eq. 9.8). Its
// sample counts are
//   n_j = 1      for s <= 1
//   n_light      for t = 1: light paths of the whole film per pixel sample, times the plan's
//                light_tracing_weight
//   n_connect    for vertex connections: the light paths that a camera vertex is connected to
// Both are constants of the plan (common/job/sampling_plan.h), not of the cache at hand, so the weights of
// all strategies sum to one. The cache is sampled systematically: every vertex has probability n_connect /
// light paths in the layer (light vertex caches: Davidovic et al. 2014). p_j are products of densities
// without Russian roulette. Any fixed function of the path keeps the sum of weights at one, and roulette ends
// both kinds of subpath at nearly the same rate.
//
// Recursion. n_j are applied where a term enters: n_light in M2 and M8, n_connect to dVCM of deeper vertices.
// Each subpath carries two partial sums (Georgiev, "Implementing Vertex Connection and Merging", 2012, eqs.
// 31-42, without merging):
//   dVCM  the ratio for connecting one vertex earlier
//   dVC   the sum of the ratios of all strategies further back
// They are ratios of densities at each step, so they stay in float range at any path length and scale.
//   start, light:  dVCM = p_direct / p_emission            dVC = cos_light / p_emission (0 if delta)   (M1)
//   start, camera: dVCM = n_light / p_camera               dVC = 0                                     (M2)
//   at a hit:      dVCM *= dist^2 / cos_in                 dVC /= cos_in                               (M3)
//                  (no dist^2 for the first segment from an infinite light or a parallel camera)
//   scattering:    dVC  = cos_out / pdf * (dVC * pdf_rev + dVCM)      dVCM = 1 / pdf                   (M4)
//   delta event:   dVC *= cos_out                                     dVCM = 0                         (M5)
// Weights, w = 1 / (1 + w_light + w_camera):
//   s = 0:  w_camera = p_direct_A * dVCM + p_emission * dVC                                            (M6)
//   s = 1:  w_light  = pdf(wi) / p_direct (0 if delta)
//           w_camera = p_emission cos / (p_direct cos_light) * (dVCM + dVC * pdf_rev)                  (M7)
//   t = 1:  w_light  = p_camera_A / n_light * (dVCM + dVC * pdf_rev)                                   (M8)
//   connect: w_light = pdf_camera->light_A / n_connect * (dVCM_l + dVC_l * pdf_rev_l), w_camera alike  (M9)
//   s = t = 1 against s = 0, t = 2: w_light = p_camera_A / (n_light p_light_A), and its reciprocal
//           p_light_A * dVCM for the hit, with p_light_A = selection / area of emission                (M10)
//           Hits see an emitter without noise but at its edges, where many splats are smoother: on a Cornell
//           box that is worth 30 % of the relative error.
// pdf_X_A is per unit area at the other vertex; cosines are to the geometric normal.
//
// Media. A vertex in a medium has a density per unit volume: that of the direction, over dist^2, times the
// rate mu at which paths collide there, times the probability P to get there without a collision. At a
// surface it has the cosine and P. So mu, the mean rate, takes the place of the cosines in M3, M4, M5, M7, M8
// and M9. P belongs to an edge of the path and is the same both ways. In dVC it cancels, and a strategy that
// joins two vertices lacks the P of that edge alone. So dVCM is divided by P in M3, and w_light and w_camera
// are multiplied by the P of the segment in M7, M8, M9 and M10 (not for the hit: its dVCM has it). That P is
// known once the segment has been traced through the boundaries of media, so those weights are completed
// then. medium_walk.h says what stands in for mu and P where their true values depend on the path's colour.
// Grids that shine are lights, where a vertex on the light has a rate, too
// (connections/volume_light_sampling.h). What a homogeneous medium emits is found by camera paths alone and
// has no weight.
//
// Guides. Where the photon guide directs a part of the camera paths (guided_density.h), pdf and pdf_rev of
// how they scatter are those of both ways together, in M4 and M7 to M9 alike.
//
// Bodies. A walk through a body is one edge, which no strategy makes by itself: M11, subsurface_walk.h.
//
// Cameras. M2 and M8 hold for all of them. p_camera is the raster area seen per unit solid angle, in pixels
// (camera_ray.h). A thin lens draws its point uniformly both for t >= 2 and for t = 1. That density is a
// factor of every p_j and cancels, so p_camera is the one of a pinhole at the lens point. That may be another
// point than the camera path of the same pixel has: weights are functions of the whole path, lens point
// included. A parallel (orthographic) camera swaps the roles: its direction has probability one in both
// strategies and its position is sampled. So its p_camera is raster area per unit area across the ray, which
// M3 and M8 turn into a density at the surface by the cosine alone.
//
// Any set of the four families (common/job/strategies.h) can run. A family that is off has no term: dVC
// starts at 0 on light paths without s = 0, M7 has no w_light then, and M6 no p_direct without s = 1. Once M6
// is done, dVCM of a vertex only stands for joining the vertex before it. It is set to 0 there if that family
// is off: light tracing for the camera's first hit, next-event estimation for the light's, connections deeper
// (times n_connect if they are on).
//
// Limit. Light subpaths are stored up to kMaxLightVertices vertices. Paths with more scattering events than
// that are left to s = 0 and s = 1, weighted between those two (dVC = 0, and dVCM in M6 is the density ratio
// of the last step). The set of strategies depends on the path's length only, so weights still sum to one.
// With the integrator `pt` this holds at every length.
#include "worker/render/math/vec.h"

namespace lightmill {

inline constexpr int kMaxLightVertices = 24;

/// The heuristic's power is 1 (balance). Another one would be applied to each ratio here. Power 2 between hit
/// and next event, whose sum keeps its weight against all other strategies, was tried: 1.03 times the
/// variance on veach-mis (95 %: 0.98 to 1.09), 0.994 on coffee (0.986 to 1.002).
template <class F>
inline F mis_weight(F w_light, F w_camera) {
  return 1.0f / (1.0f + w_light + w_camera);
}

}  // namespace lightmill
