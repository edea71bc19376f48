#include "worker/render/scene/instancing.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/scene/transform.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {
namespace {

constexpr size_t kMaxFlattened = 100'000'000;  // primitives

/// |A||W| beyond this costs a ray ten bits; a ratio of scales beyond that could leave float's range.
constexpr double kMaxSpread = 0x1p10, kMaxStretch = 0x1p30;

size_t primitives_of(const ShapeDescription& s) {
  const auto* mesh = std::get_if<MeshShape>(&s.kind);
  return mesh ? mesh->mesh->triangles.size() : 1;
}

double largest(const Transform& t) {
  double size = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) size = std::max(size, std::fabs(t.m[i][j]));
  }
  return size;
}

/// Max row sum of |a||b|.
double row_sum(const Transform& a, const Transform& b) {
  double most = 0;
  for (size_t i = 0; i < 3; ++i) {
    double sum = 0;
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) sum += std::fabs(a.m[i][k] * b.m[k][j]);
    }
    most = std::max(most, sum);
  }
  return most;
}

/// Without translation and with entries of about 1; the power of two that it was multiplied by.
Transform of_size_one(const Transform& t, int* exponent) {
  *exponent = -std::ilogb(largest(t));
  Transform out;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) out.m[i][j] = std::ldexp(t.m[i][j], *exponent);
  }
  return out;
}

bool fit_for_rays(const Transform& t) {
  if (!is_affine(t) || !(largest(t) > 0)) return false;
  int exponent = 0;
  const Transform unit = of_size_one(t, &exponent), back = inverse(unit);
  // Written so that NaN is refused.
  return row_sum(unit, back) <= kMaxSpread && largest(back) <= kMaxStretch;
}

void measure(InstancedObject* o) {
  std::fill(o->lo, o->lo + 3, 1e300);
  std::fill(o->hi, o->hi + 3, -1e300);
  const auto add = [&](const Vec3d& p, double r) {
    const double c[3] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; ++i)
      o->lo[i] = std::min(o->lo[i], c[i] - r), o->hi[i] = std::max(o->hi[i], c[i] + r);
  };
  for (const ShapeDescription* s : o->shapes) {
    if (const auto* mesh = std::get_if<MeshShape>(&s->kind)) {
      for (const Vec3f& p : mesh->mesh->positions)
        add(transform_point(s->object_to_world, {p.x, p.y, p.z}), 0);
    } else {
      const Transform& t = s->object_to_world;  // a similarity
      const double scale = length({t.m[0][0], t.m[1][0], t.m[2][0]});
      add(transform_point(t, {}), scale * std::get<SphereShape>(s->kind).radius);
    }
  }
  o->center = {0.5 * (o->lo[0] + o->hi[0]), 0.5 * (o->lo[1] + o->hi[1]), 0.5 * (o->lo[2] + o->hi[2])};
  const double size = std::max({o->hi[0] - o->lo[0], o->hi[1] - o->lo[1], o->hi[2] - o->lo[2]});
  o->exponent = size > 0 ? -std::ilogb(size) : 0;
}

/// Appends copies of shapes to the world.
class Flattener {
 public:
  explicit Flattener(SplitScene* out) : out_(*out) {}

  void add(const ShapeDescription& shape, const Transform& object_to_world) {
    primitives_ += primitives_of(shape);
    if (primitives_ > kMaxFlattened) {
      throw Error(
          ErrorKind::kBadScene,
          "instances that can't share their geometry, as they emit or are nearly singular, add up to more "
          "than 100000000 triangles; leave some out");
    }
    ShapeDescription& s = out_.flattened.emplace_back(shape);
    s.object_to_world = object_to_world * shape.object_to_world;
  }

 private:
  SplitScene& out_;
  size_t primitives_ = 0;
};

}  // namespace

SplitScene split_instances(const SceneDescription& scene) {
  SplitScene out;
  if (scene.instances.empty()) return out;
  const size_t count = scene.objects.size();
  std::vector<size_t> uses(count, 0);
  for (const InstanceDescription& i : scene.instances) ++uses[static_cast<size_t>(i.object)];
  constexpr size_t kNone = ~size_t{0};
  std::vector<size_t> built(count, kNone);  // index into out.objects
  size_t copies = 0;                        // primitives of small objects that are flattened
  for (size_t i = 0; i < count; ++i) {
    InstancedObject o;
    size_t primitives = 0;
    for (const ShapeDescription& s : scene.objects[i].shapes) {
      if (s.area_light >= 0) continue;
      o.shapes.push_back(&s);
      primitives += primitives_of(s);
    }
    if (uses[i] < 2 || primitives == 0) continue;
    if (primitives <= kSmallObject && primitives * uses[i] <= kFlattenedPrimitives - copies) {
      copies += primitives * uses[i];
      continue;
    }
    measure(&o);
    built[i] = out.objects.size();
    out.objects.push_back(std::move(o));
  }
  Flattener flattener(&out);
  for (const InstanceDescription& i : scene.instances) {
    const auto object = static_cast<size_t>(i.object);
    const bool instanced = built[object] != kNone && fit_for_rays(i.object_to_world);
    if (instanced) out.instances.push_back({built[object], &i.object_to_world});
    const size_t before = out.flattened.size();
    for (const ShapeDescription& s : scene.objects[object].shapes) {
      if (!instanced || s.area_light >= 0) flattener.add(s, i.object_to_world);
    }
    out.flattened_instances += out.flattened.size() > before;
  }
  return out;
}

bool instance_record(const InstancedObject& object, const Transform& object_to_world, const Vec3d& position,
                     int scene_exponent, float* record) {
  int exponent = 0;
  Transform a = of_size_one(object_to_world, &exponent);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      a.m[i][j] = double{static_cast<float>(a.m[i][j])};
      record[kInstanceA + 3 * i + j] = static_cast<float>(a.m[i][j]);
    }
  }
  const Transform w = inverse(a);  // of the rounded matrix
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) record[kInstanceW + 3 * i + j] = static_cast<float>(w.m[i][j]);
  }
  record[kInstancePosition] = static_cast<float>(position.x);
  record[kInstancePosition + 1] = static_cast<float>(position.y);
  record[kInstancePosition + 2] = static_cast<float>(position.z);
  // Object space is 2^object.exponent of the object's own, normalised space 2^scene_exponent of the scene's.
  const int time_exponent = exponent + object.exponent - scene_exponent;
  constexpr int kSmallest = 100;  // of it, squares are out of range; it is not seen from anywhere
  if (std::abs(time_exponent) > kSmallest) return false;  // or its object has no size
  record[kInstanceTimeScale] = std::ldexp(1.0f, time_exponent);
  record[kInstanceSpread] = static_cast<float>(row_sum(a, w));
  record[kInstanceHandedness] = determinant3(a) < 0 ? -1.0f : 1.0f;
  return true;
}

}  // namespace lightmill
