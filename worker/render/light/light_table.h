#pragma once
// All lights of a scene as flat arrays, and how one is selected: in proportion to power (Walker's alias
// method) for light paths, and for next-event estimation too unless there are many; then by what may reach
// the point (light_tree.h).
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/render/light/environment_map.h"
#include "worker/render/light/light_tree.h"

namespace lightmill {

using LightType = int32_t;
inline constexpr LightType kTriangleLight = 0, kSphereLight = 1, kPointLight = 2, kInfiniteLight = 3,
                           kDistantLight = 4, kSpotLight = 5;

/// With more lights than this that are not at infinity, next-event estimation selects by the light tree.
inline constexpr int kAliasLights = 16;

/// What an infinite light has in place of a map: the same radiance everywhere, or in a cone alone.
inline constexpr float kEvenSky = -1, kSunCone = -2;

inline constexpr int kLightFloats = 20;
/// Slots of one light's record (stride kLightFloats):
///   triangle  0 v0, 3 e1, 6 e2, 9 unit normal of the emitting side
///   sphere    0 centre, 3 radius, 9 unused, 12 orientation (+1 emits outwards, -1 inwards)
///   point     0 position
///   spot      0 position, 4 cosines of the half angles where the falloff starts and 5 ends, 9 unit axis
///   infinite  0 centre of the scene's bounding sphere, 3 its radius, 4 environment map number, kEvenSky or
///             kSunCone; a sun also 5 its 1 - cos(half angle), 9 unit direction in which it shines
///   distant   0 and 3 as infinite, 9 unit direction in which it shines
///   all       13 radiance rgb (point, spot: intensity), 16 area, 17 selection probability by power,
///             18 two-sided (0 or 1), 19 with a light tree: selection probability of lights at infinity
enum LightSlot {
  kLightP = 0,
  kLightE1 = 3,
  kLightE2 = 6,
  kLightN = 9,
  kLightOrientation = 12,
  kLightRadiance = 13,
  kLightArea = 16,
  kLightSelect = 17,
  kLightTwoSided = 18,
  kLightAtInfinitySelect = 19
};

struct LightTable {
  std::vector<float> records;     // kLightFloats per light
  std::vector<int32_t> type;      // LightType per light
  std::vector<float> alias_keep;  // alias method: keep probability
  std::vector<int32_t> alias;     //               other index
  std::vector<int32_t> infinite;  // indices of the infinite lights (what an escaping ray sees)
  LightTree tree;                 // empty: next-event estimation selects by power
  float infinity_share = 0;       // with a tree: probability of choosing from `at_infinity` instead
  std::vector<int32_t> at_infinity, at_infinity_alias;  // infinite and distant lights, selected by power
  std::vector<float> at_infinity_keep;
  std::vector<EnvironmentMap> environments;
  bool any_delta = false;  // point, spot or distant lights present
  bool any_spot = false;
  bool any_sun = false;  // infinite lights that fill a cone
  bool any_distant = false;
  bool only_delta = true;  // nothing that a ray can hit or escape to
  bool any_sphere = false;
  double total_power = 0;  // W, mean over channels, in normalised space

  /// Lights at infinity exist (their paths start on a disk across the scene).
  bool any_infinite() const { return !infinite.empty() || any_distant; }
  int32_t count() const { return static_cast<int32_t>(type.size()); }
  /// Appends a light; `power` (W, any channel mean) decides how often it is selected.
  void add(LightType light_type, const std::array<float, kLightFloats>& record, double power);
  /// Builds the selection tables; call once after the last add().
  void finish();

 private:
  void build_tree();
  std::vector<double> powers_;
};

}  // namespace lightmill
