#include "worker/render/accel/few_primitives.h"

#include <algorithm>
#include <limits>

#include "worker/render/math/vec.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/geometry/sphere_hit.h"

namespace lightmill {
namespace {

constexpr int kMostPrimitives = 128;
constexpr int kRays = 8;  // the last of them may be one ray again and again

/// a b + c, rounded once.
Float8 fma(Float8 a, Float8 b, Float8 c) {
  return reinterpret_cast<Float8>(
      _mm256_fmadd_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(c)));
}
Float8 broadcast(const float& x) { return reinterpret_cast<Float8>(_mm256_broadcast_ss(&x)); }
Float8 dot(const float a[3], const Vec3<Float8>& b) {
  return fma(broadcast(a[2]), b.z, fma(broadcast(a[1]), b.y, a[0] * b.x));
}

/// Whether the ray, which is at 0, is within the face's corners along one axis across it, give or take much
/// more than rounding: sides of faces that are smaller than that say nothing.
Int8 near_ray(const Float8* at, const FaceTable::Face& f) {
  const Float8 a = at[f.corner[0]], b = at[f.corner[1]], c = at[f.corner[2]], d = at[f.corner[3]];
  const Float8 low = min(min(a, b), min(c, d)), high = max(max(a, b), max(c, d));
  const Float8 slack = max(abs(low), abs(high)) * 0x1p-20f;
  return (low <= slack) & (high >= -slack);
}

}  // namespace

struct FewPrimitives::Rays {
  Vec3<Float8> o, d;
};

bool FewPrimitives::suits(const RenderScene& scene) {
  return !scene.any_instances() && scene.sphere_hidden.empty() &&
         scene.triangle_count() + scene.sphere_count() <= kMostPrimitives &&
         std::none_of(scene.meshes.begin(), scene.meshes.end(), [](const MeshRange& m) {
           return has_alpha_mask(m.alpha) || m.fibres != 0 || m.hidden != 0;
         });
}

FewPrimitives::FewPrimitives(const RenderScene& scene)
    : table_(scene), spheres_(scene.spheres), triangles_(scene.triangle_count()) {
  for (const FaceTable::Halves& h : table_.halves)
    passed_.push_back(scene.is_passed(h.first) || scene.is_passed(h.second));
  for (int32_t s = 0; s < scene.sphere_count(); ++s) passed_.push_back(scene.is_passed(triangles_ + s));
}

/// Every face is tested to the end: to leave those out that no ray of the eight meets in time was tried, for
/// shadow rays it took 0.98 (0.94 to 1.02) of the time of bdpt on cornell-box and 1.00 on veach-mis, for
/// closest hits more. found(number, t, mask): lanes of `mask` meet it at t > 0. Faces are numbered first,
/// then spheres.
template <class Found>
void FewPrimitives::for_each_hit(const Rays& r, Found&& found) const {
  // The corners seen along the ray. Each is rounded once, whichever faces meet there, and so is each edge,
  // whichever way it is walked.
  Float8 x[3 * kMostPrimitives], y[3 * kMostPrimitives];
  const Frame<Float8> frame(normalize(r.d));
  for (size_t i = 0; i < table_.corners.size(); ++i) {
    const float* p = table_.corners[i].p;
    const Vec3<Float8> v{p[0] - r.o.x, p[1] - r.o.y, p[2] - r.o.z};
    x[i] = fma(v.z, frame.s.z, fma(v.y, frame.s.y, v.x * frame.s.x));
    y[i] = fma(v.z, frame.t.z, fma(v.y, frame.t.y, v.x * frame.t.x));
  }
  int32_t number = 0;
  for (const FaceTable::Face& f : table_.faces) {
    Float8 side[4];
    for (int k = 0; k < 4; ++k) {
      const int32_t a = f.corner[k], b = f.corner[(k + 1) % 4];
      side[k] = x[a] * y[b] - y[a] * x[b];
    }
    Int8 inside = (min(min(side[0], side[1]), min(side[2], side[3])) >= 0.0f) |
                  (max(max(side[0], side[1]), max(side[2], side[3])) <= 0.0f);
    if (f.tiny) inside &= near_ray(x, f) & near_ray(y, f);
    const Vec3<Float8> from{f.at[0] - r.o.x, f.at[1] - r.o.y, f.at[2] - r.o.z};
    // Along the plane: infinite or NaN, which is less than nothing.
    const Float8 t = dot(f.normal, from) / dot(f.normal, r.d);
    found(number++, t, inside & (t > 0.0f));
  }
  for (size_t s = 0; s < spheres_.size(); s += 4, ++number) {
    const float* sphere = &spheres_[s];
    const Vec3<Float8> to_center{sphere[0] - r.o.x, sphere[1] - r.o.y, sphere[2] - r.o.z};
    const Float8 along = lightmill::dot(to_center, r.d), d2 = lightmill::dot(r.d, r.d),
                 c2 = lightmill::dot(to_center, to_center);
    // The line's distance from the centre, which is ahead, or the ray starts inside; the slack is many times
    // what rounding can do.
    const Float8 reach = c2 * 0x1p-18f + sphere[3] * sphere[3] * (1 + 0x1p-18f);
    const Int8 ahead = (along > 0.0f) | (c2 <= reach), near = ahead & (c2 * d2 - along * along <= reach * d2);
    if (!any(near)) continue;
    Double4 roots[2];
    for (int part = 0; part < 2; ++part) {
      const auto wide = [&](const Vec3<Float8>& v) {
        return Vec3<Double4>{to_double(v.x, part), to_double(v.y, part), to_double(v.z, part)};
      };
      const Vec3<Double4> from = wide(r.o),
                          center{Double4{} + sphere[0], Double4{} + sphere[1], Double4{} + sphere[2]};
      roots[part] = sphere_hit<Double4>(from - center, wide(r.d), Double4{} + sphere[3], Double4{},
                                        Double4{} + double{kInfinity});
    }
    const Float8 distance = from_double(roots);
    found(number, distance, near & (distance > 0.0f));
  }
}

void FewPrimitives::closest_hits(TracedRay* rays, const int32_t* ids, int count) const {
  const auto faces = static_cast<int32_t>(table_.faces.size());
  for (int begin = 0; begin < count; begin += kRays) {
    const int n = std::min(kRays, count - begin);
    const Int8 i = lane_index<Float8>();
    Float8 f[8];
    load_records(as_records(rays), gather(ids + begin, i < n ? i : n - 1), f);
    const Rays r{{f[0], f[1], f[2]}, {f[3], f[4], f[5]}};
    Float8 nearest = splat<Float8>(kInfinity);
    Int8 hit = splat_int<Float8>(-1);
    for_each_hit(r, [&](int32_t number, const Float8& t, const Int8& mask) {
      const Int8 nearer = mask & (t < nearest);
      nearest = select(nearer, t, nearest);
      hit = select(nearer, splat_int<Float8>(number), hit);
    });
    const Int8 on_face = (hit >= 0) & (hit < faces);
    Int8 number = hit < faces ? hit : hit - faces + triangles_;
    if (any(on_face)) {
      static_assert(sizeof(FaceTable::Halves) == 8 * sizeof(float));
      Float8 h[8];
      load_octets(table_.halves.front().across, (on_face ? hit : 0) * 8, h);
      const Vec3<Float8> p = r.o + r.d * select(on_face, nearest, Float8{});
      const Int8 second = h[0] * p.x + h[1] * p.y + h[2] * p.z > h[3];
      number = on_face ? as_int(float_bits(second ? h[5] : h[4])) : number;
    }
    for (int l = 0; l < n; ++l) rays[ids[begin + l]].prim = number[l], rays[ids[begin + l]].instance = -1;
  }
}

void FewPrimitives::occluded(const RayView& rays, const float* tfar, int count, uint8_t* occluded,
                             uint8_t* crossed) const {
  for (int begin = 0; begin < count; begin += kRays) {
    const int n = std::min(kRays, count - begin);
    const Int8 i = lane_index<Float8>(), index = (i < n ? i : n - 1) + begin;
    const auto eight = [&](const float* of) {
      return n == kRays ? load<Float8>(of + begin) : gather(of, index);
    };
    const Rays r{{eight(rays.ox), eight(rays.oy), eight(rays.oz)},
                 {eight(rays.dx), eight(rays.dy), eight(rays.dz)}};
    const Float8 end = eight(tfar);
    Int8 blocked{}, passed{};
    for_each_hit(r, [&](int32_t number, const Float8& t, const Int8& mask) {
      const bool passes = crossed && passed_[static_cast<size_t>(number)];
      (passes ? passed : blocked) |= mask & (t < end);
    });
    for (int l = 0; l < n; ++l) occluded[begin + l] = blocked[l] != 0;
    for (int l = 0; crossed && l < n; ++l) crossed[begin + l] = passed[l] != 0;
  }
}

}  // namespace lightmill
