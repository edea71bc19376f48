#include "worker/render/plan/analysis/path_classes.h"

#include <algorithm>

namespace lightmill {
namespace {

constexpr int kMostEvents = 4;

/// Whether no ray ends on light `i`: it is at a point, far away, a lamp among media, or of a shape that rays
/// do not meet.
bool is_never_hit(const LightTable& lights, size_t i) {
  if (is_at_a_point(lights.type[i]) || lights.type[i] == kDistantLight) return true;
  const LightType type = lights.type[i];
  if (type == kRectangleLamp || type == kEllipseLamp || type == kFacingLamp) return lights.lamps.empty();
  const int32_t pattern = lights.pattern_of.empty() ? -1 : lights.pattern_of[i];
  return pattern >= 0 && lights.patterns[static_cast<size_t>(pattern)].unseen;
}

/// Events from the light on; bit i of `specular`: event i is S.
struct PathClass {
  bool hit;  // its light is one that rays meet
  int events;
  unsigned specular;

  bool diffuse(int i) const { return !(specular >> i & 1); }
  PathClasses bit() const {
    const unsigned number = (1U << events) - 1 + specular;  // by length, then by what they are
    return PathClasses{1} << (2 * number + (hit ? 0 : 1));
  }
  Strategies makers() const {
    Strategies set = hit ? kEmissionHits : 0;
    if (events == 0) return hit ? set | kLightTracing : set;
    if (diffuse(events - 1)) set |= kLightTracing;
    if (diffuse(0)) set |= kNextEvent;
    for (int i = 0; i + 1 < events; ++i) {
      if (diffuse(i) && diffuse(i + 1)) set |= kVertexConnections;
    }
    return set;
  }
};

template <class Visit>
void for_each_class(Visit&& visit) {
  for (int events = 0; events <= kMostEvents; ++events) {
    for (unsigned specular = 0; specular < 1U << events; ++specular) {
      for (const bool hit : {true, false}) visit(PathClass{hit, events, specular});
    }
  }
}

/// What the camera sees directly of media that shine, and all of that of homogeneous ones: camera paths alone
/// find it. Grids that shine are lights.
constexpr PathClasses kOfMedia = PathClasses{1} << 62;

bool any_medium_shines(const RenderScene& scene) {
  for (size_t m = 0; m < scene.media.size(); m += kMediumFloats) {
    const float* const e = &scene.media[m + kMediumEmission];
    if (e[0] > 0 || e[1] > 0 || e[2] > 0) return true;
  }
  return false;
}

}  // namespace

PathClasses paths_made(const RenderScene& scene, int max_depth, Strategies strategies) {
  bool any_hit = false, any_missed = false;
  for (size_t i = 0; i < scene.lights.type.size(); ++i)
    (is_never_hit(scene.lights, i) ? any_missed : any_hit) = true;
  PathClasses made = strategies & kEmissionHits && any_medium_shines(scene) ? kOfMedia : 0;
  for_each_class([&](const PathClass& path) {
    const bool there = (path.hit ? any_hit : any_missed) && path.events <= max_depth &&
                       (path.specular == 0 || scene.any_delta);
    if (there && path.makers() & strategies) made |= path.bit();
  });
  return made;
}

std::string shortest_path(PathClasses classes) {
  std::string text;
  for_each_class([&](const PathClass& path) {
    if (!text.empty() || !(classes & path.bit())) return;
    text.assign(1, 'L');
    for (int i = 0; i < path.events; ++i) text += path.diffuse(i) ? 'D' : 'S';
    text += path.hit ? "E" : "E from lights at a point or far away";
  });
  if (text.empty() && classes & kOfMedia) text = "LE from media";
  return text;
}

}  // namespace lightmill
