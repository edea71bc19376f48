#include "worker/render/scene/geometry/instancing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/base/error.h"
#include "common/scene/motion.h"
#include "common/scene/transform.h"
#include "worker/render/scene/geometry/instance_pose.h"
#include "worker/render/scene/geometry/shape_space.h"
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

/// Without translation, times 2^exponent.
Transform scaled_linear(const Transform& t, int exponent) {
  Transform out;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) out.m[i][j] = std::ldexp(t.m[i][j], exponent);
  }
  return out;
}

bool fit_for_rays(const Transform& t) {
  if (!is_affine(t) || !(largest(t) > 0)) return false;
  const Transform unit = scaled_linear(t, record_exponent(t)), back = inverse(unit);
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
      const auto add_all = [&](const std::vector<Vec3f>& positions) {
        for (const Vec3f& p : positions) add(transform_point(s->object_to_world, {p.x, p.y, p.z}), 0);
      };
      add_all(mesh->mesh->positions);
      if (bends(*s)) {
        for (const MeshStep& step : mesh->mesh->later) add_all(step.positions);
      }
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

bool is_sphere_emitter(const ShapeDescription& s) {
  return s.area_light >= 0 && std::holds_alternative<SphereShape>(s.kind);
}

/// Appends copies of shapes to the world.
class Flattener {
 public:
  explicit Flattener(SplitScene* out) : out_(*out) {}

  void add(const ShapeDescription& shape, const Transform& object_to_world, RayKinds hidden = 0,
           const PartNames& names = {}) {
    primitives_ += primitives_of(shape);
    if (primitives_ > kMaxFlattened) {
      throw Error(
          ErrorKind::kBadScene,
          "instances that can't share their geometry, as they emit or are nearly singular, add up to more "
          "than 100000000 triangles; leave some out");
    }
    ShapeDescription& s = out_.flattened.emplace_back(shape);
    s.object_to_world = object_to_world * shape.object_to_world;
    s.moves_to = -1;
    s.hidden |= hidden;
    s.names = named_by(names, s.names);
  }

 private:
  SplitScene& out_;
  size_t primitives_ = 0;
};

/// Where things are that move by all of `links`, the outermost first.
Transform along(const std::vector<Way>& links, double s) {
  Transform t;
  for (const Way& link : links) t = t * link.at(s);
  return t;
}

/// How far the corners of the object's box are from where even changes put them, half way between `a` and
/// `b`, as a fraction of its size.
double bend(const InstancedObject& o, const Transform& a, const Transform& middle, const Transform& b) {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  double most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d c{corner & 1 ? o.hi[0] : o.lo[0], corner & 2 ? o.hi[1] : o.lo[1],
                  corner & 4 ? o.hi[2] : o.lo[2]};
    const Vec3d p = transform_point(a, c), q = transform_point(b, c), r = transform_point(middle, c);
    most =
        std::max(most, length({r.x - 0.5 * (p.x + q.x), r.y - 0.5 * (p.y + q.y), r.z - 0.5 * (p.z + q.z)}));
    low = {std::min(low.x, r.x), std::min(low.y, r.y), std::min(low.z, r.z)};
    high = {std::max(high.x, r.x), std::max(high.y, r.y), std::max(high.z, r.z)};
  }
  const double size = length({high.x - low.x, high.y - low.y, high.z - low.z});
  return size > 0 ? most / size : 0;
}

/// As many transforms as keep everything within kMostBend of its way: a tenth of a pixel for an object of a
/// thousand. A turn of 180 degrees takes 128 segments, a straight way one.
std::vector<Transform> way_of(const InstancedObject& object, const std::vector<Way>& links) {
  constexpr double kMostBend = 1e-4, kDegrees = 2;  // of a turn that bends about as much
  double degrees = 0;
  for (const Way& link : links) degrees += link.degrees();
  int32_t segments = 1;
  while (segments < kMostSegments && degrees > kDegrees * segments) segments *= 2;
  for (;; segments *= 2) {
    std::vector<Transform> way;
    for (int32_t i = 0; i <= segments; ++i) way.push_back(along(links, static_cast<double>(i) / segments));
    bool straight = true;
    for (int32_t i = 0; straight && segments < kMostSegments && i < segments; ++i) {
      const auto k = static_cast<size_t>(i);
      straight = bend(object, way[k], along(links, (i + 0.5) / segments), way[k + 1]) <= kMostBend;
    }
    if (straight) return way;
  }
}

/// Puts what moves into a scene that is being split.
class Mover {
 public:
  Mover(const SceneDescription& scene, SplitScene* out, Flattener* flattener)
      : in_(scene), out_(*out), flattener_(*flattener) {}

  Way way(const Transform& start, int moves_to) const { return {start, moves_to, in_}; }
  /// Builds objects of those of `shapes` that move, one for each way; their indices and first shapes.
  /// `shared`: by several instances, so emitters are not among them.
  std::vector<std::pair<size_t, const ShapeDescription*>> build(const std::vector<ShapeDescription>& shapes,
                                                                bool shared) {
    // Those that bend where they are go together if they are in the same place.
    std::map<std::pair<int, Matrix>, size_t> by_way;
    std::vector<std::pair<size_t, const ShapeDescription*>> built;
    for (const ShapeDescription& s : shapes) {
      if (!changes(s) || (shared && s.area_light >= 0)) continue;
      const Matrix place = s.moves_to < 0 ? s.object_to_world.m : Matrix{};
      const auto [found, is_new] = by_way.try_emplace({s.moves_to, place}, out_.objects.size());
      if (is_new) {
        out_.objects.emplace_back();
        built.emplace_back(found->second, &s);
      }
      ShapeDescription& own = out_.moving.emplace_back(s);
      own.object_to_world = {};
      own.moves_to = -1;
      out_.objects[found->second].shapes.push_back(&own);
    }
    for (const auto& [object, first] : built) measure(&out_.objects[object]);
    return built;
  }
  /// Builds an object of one shape alone, in which it is as `to_object` says.
  size_t build_alone(const ShapeDescription& s, const Transform& to_object) {
    ShapeDescription& own = out_.moving.emplace_back(s);
    own.object_to_world = to_object;
    own.moves_to = -1;
    out_.objects.emplace_back().shapes.push_back(&own);
    measure(&out_.objects.back());
    return out_.objects.size() - 1;
  }
  /// One more occurrence of an object that moves by `links`.
  void place(size_t object, const std::vector<Way>& links, RayKinds hidden = 0, const PartNames& names = {}) {
    const InstancedObject& o = out_.objects[object];
    std::vector<Transform> way = way_of(o, links);
    if (std::all_of(way.begin(), way.end(), fit_for_rays)) {
      moving_.push_back({object, way.data(), static_cast<int32_t>(out_.ways.size()), hidden, names});
      out_.ways.push_back(std::move(way));
      return;
    }
    for (const ShapeDescription* s : o.shapes) flattener_.add(*s, way.front(), hidden, names);
    out_.stopped.push_back(o.shapes.front());
  }
  /// Once everything that stands still is there.
  void finish() { out_.instances.insert(out_.instances.end(), moving_.begin(), moving_.end()); }

 private:
  const SceneDescription& in_;
  SplitScene& out_;
  Flattener& flattener_;
  std::vector<PlacedObject> moving_;
};

}  // namespace

bool bends(const ShapeDescription& shape) {
  const auto* mesh = std::get_if<MeshShape>(&shape.kind);
  return mesh && !mesh->mesh->later.empty();
}

bool changes(const ShapeDescription& shape) {
  return (shape.moves_to >= 0 && !is_sphere_emitter(shape)) || bends(shape);
}

SplitScene split_instances(const SceneDescription& scene) {
  SplitScene out;
  if (scene.instances.empty() && scene.later.empty() && std::ranges::none_of(scene.shapes, bends)) return out;
  const size_t count = scene.objects.size();
  std::vector<size_t> uses(count, 0);
  std::vector<bool> moves(count, false);
  for (const InstanceDescription& i : scene.instances) {
    ++uses[static_cast<size_t>(i.object)];
    if (i.moves_to >= 0) moves[static_cast<size_t>(i.object)] = true;
  }
  constexpr size_t kNone = ~size_t{0};
  std::vector<size_t> built(count, kNone);  // index into out.objects, of what stands still in the object
  size_t copies = 0;                        // primitives of small objects that are flattened
  for (size_t i = 0; i < count; ++i) {
    InstancedObject o;
    size_t primitives = 0;
    for (const ShapeDescription& s : scene.objects[i].shapes) {
      if (s.area_light >= 0 || changes(s)) continue;
      o.shapes.push_back(&s);
      primitives += primitives_of(s);
    }
    if (primitives == 0) continue;
    if (!moves[i]) {
      if (uses[i] < 2) continue;
      if (primitives <= kSmallObject && primitives * uses[i] <= kFlattenedPrimitives - copies) {
        copies += primitives * uses[i];
        continue;
      }
    }
    measure(&o);
    built[i] = out.objects.size();
    out.objects.push_back(std::move(o));
  }
  Flattener flattener(&out);
  Mover mover(scene, &out, &flattener);
  for (const auto& [object, shape] : mover.build(scene.shapes, false))
    mover.place(object, {mover.way(shape->object_to_world, shape->moves_to)});
  std::vector<std::vector<std::pair<size_t, const ShapeDescription*>>> parts(count);  // of it that move
  for (size_t i = 0; i < count; ++i) {
    if (uses[i] > 0) parts[i] = mover.build(scene.objects[i].shapes, true);
  }
  for (const InstanceDescription& i : scene.instances) {
    const auto object = static_cast<size_t>(i.object);
    const size_t before = out.flattened.size();
    for (const auto& [part, shape] : parts[object]) {
      mover.place(
          part,
          {mover.way(i.object_to_world, i.moves_to), mover.way(shape->object_to_world, shape->moves_to)},
          i.hidden, i.names);
    }
    const bool instanced = built[object] != kNone && (i.moves_to >= 0 || fit_for_rays(i.object_to_world));
    if (instanced && i.moves_to >= 0) {
      mover.place(built[object], {mover.way(i.object_to_world, i.moves_to)}, i.hidden, i.names);
    } else if (instanced) {
      out.instances.push_back({built[object], &i.object_to_world, -1, i.hidden, i.names});
    }
    for (const ShapeDescription& s : scene.objects[object].shapes) {
      if (s.area_light >= 0 && !is_sphere_emitter(s) && (changes(s) || i.moves_to >= 0)) {
        const size_t alone = mover.build_alone(s, s.moves_to >= 0 ? Transform{} : s.object_to_world);
        std::vector<Way> links{mover.way(i.object_to_world, i.moves_to)};
        if (s.moves_to >= 0) links.push_back(mover.way(s.object_to_world, s.moves_to));
        mover.place(alone, links, i.hidden, i.names);
      } else if (!changes(s) && (!instanced || s.area_light >= 0)) {
        flattener.add(s, i.object_to_world, i.hidden, i.names);
      }
    }
    out.flattened_instances += out.flattened.size() > before;
  }
  mover.finish();
  return out;
}

int record_exponent(const Transform& object_to_world) { return -std::ilogb(largest(object_to_world)); }

bool instance_record(const InstancedObject& object, const Transform& object_to_world, int exponent,
                     const Vec3d& position, int scene_exponent, float* record) {
  const Transform a = scaled_linear(object_to_world, exponent);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) record[kInstanceA + 3 * i + j] = static_cast<float>(a.m[i][j]);
  }
  record[kInstancePosition] = static_cast<float>(position.x);
  record[kInstancePosition + 1] = static_cast<float>(position.y);
  record[kInstancePosition + 2] = static_cast<float>(position.z);
  finish_record(record);
  // Object space is 2^object.exponent of the object's own, normalised space 2^scene_exponent of the scene's.
  const int time_exponent = exponent + object.exponent - scene_exponent;
  constexpr int kSmallest = 100;  // of it, squares are out of range; it is not seen from anywhere
  if (std::abs(time_exponent) > kSmallest) return false;  // or its object has no size
  record[kInstanceTimeScale] = std::ldexp(1.0f, time_exponent);
  return true;
}

std::vector<double> rounding_of_instances(const SplitScene& split, const Vec3d& origin) {
  std::vector<double> rounding(split.objects.size(), 0);
  for (const PlacedObject& i : split.instances) {
    const InstancedObject& o = split.objects[i.object];
    const Transform &t = *i.object_to_world, unit = scaled_linear(t, record_exponent(t)),
                    back = inverse(unit);
    const double scale = std::ldexp(1, -record_exponent(t));
    double size = 0, place = 0, inwards = 0;
    const Vec3d at = transform_point(t, o.center);
    const double to[3] = {at.x - origin.x, at.y - origin.y, at.z - origin.z};
    for (size_t k = 0; k < 3; ++k) {
      double row = 0, back_row = 0;
      for (size_t j = 0; j < 3; ++j) {
        row += std::fabs(unit.m[k][j]) * 0.5 * (o.hi[j] - o.lo[j]);
        back_row += std::fabs(back.m[k][j]);
      }
      size = std::max(size, row * scale);
      place = std::max(place, std::fabs(to[k]) + row * scale);
      inwards = std::max(inwards, back_row / scale);
    }
    constexpr double kRound = 0x1p-24;
    const double error = 12 * kRound * row_sum(unit, back) * size + 3 * kRound * place;
    rounding[i.object] = std::max(rounding[i.object], std::ldexp(error * inwards, o.exponent));
  }
  return rounding;
}

}  // namespace lightmill
