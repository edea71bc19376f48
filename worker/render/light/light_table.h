#pragma once
// All lights of a scene as flat arrays, and how one is selected.
//
// Light paths select by power (Walker's alias method; a small part evenly), or by an emission guide
// (training/emission_guide_training.h). Next-event estimation selects by power, too; if there are many
// lights, by what may reach the point (light_tree.h). Where much of the light is hidden a guide says what was
// seen to get there (next_event_guide.h).
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/render/guiding/next_event_guide.h"
#include "worker/render/light/environment_map.h"
#include "worker/render/light/light_tree.h"
#include "worker/render/light/portal.h"
#include "worker/render/light/projection_map.h"
#include "worker/render/light/shared_list.h"

namespace lightmill {

using LightType = int32_t;
inline constexpr LightType kTriangleLight = 0, kSphereLight = 1, kRectangleLamp = 2, kEllipseLamp = 3,
                           kPointLight = 4, kSpotLight = 5, kGoniometricLight = 6, kProjectionLight = 7,
                           kInfiniteLight = 8, kDistantLight = 9, kVolumeLight = 10, kFacingLamp = 11;
/// The last of those whose points have a normal.
inline constexpr LightType kLastWithNormal = kEllipseLamp;
constexpr bool is_at_a_point(LightType type) { return type >= kPointLight && type < kInfiniteLight; }

/// With more lights than this that are not at infinity, next-event estimation selects by the light tree.
inline constexpr int kAliasLights = 16;

/// By power, a light with this part of another's is next to never drawn, and the other one may be hidden.
inline constexpr double kUnequal = 0x1p-12;

/// What an infinite light has in place of a map: the same radiance everywhere, or in a cone only.
inline constexpr float kEvenSky = -1, kSunCone = -2;

inline constexpr int kLightFloats = 20;
/// Slots of one light's record (stride kLightFloats):
///   triangle  0 v0, 3 e1, 6 e2, 9 unit normal of the emitting side
///   sphere    0 centre, 3 radius, 9 unused, 12 orientation (+1 emits outwards, -1 inwards)
///   rectangle, ellipse: lamps (lamp.h); 0 centre, 3 and 6 from there to the middles of two sides or the ends
///             of two half axes, 9 unit normal of the emitting side, 12 1 / tan of the spread's half angle
///   point     0 position
///   spot      0 position, 4 and 5 1 - cos of the half angles where the falloff starts and ends, 6 1 if
///             it also falls as the cosine, else 0, 9 unit axis
///   facing    a lamp; 0 centre, 3 radius, 4, 5, 6 and 9 as a spot, 5 being 0 for a lamp without a cone
///   goniometric  0 position, 4 number of its map
///   projection   0 position, 4 number of its map, 5 cosine of its half angle, to the corners, 9 unit axis
///   infinite  0 centre of the scene's bounding sphere, 3 its radius, 4 environment map number, kEvenSky or
///             kSunCone, 6 1 + number of its portal or 0; a sun also 5 its 1 - cos(half angle), 9 unit
///             direction in which it shines
///   distant   0 and 3 as infinite, 7 1 + number of its emission cells or 0, 9 unit direction in which it
///             shines
///   volume    0 a corner of a box around what shines, 3, 6 and 9 its edges from there
///   all       13 radiance rgb (at a point: intensity; with a map the brightest texel's), 16 area,
///             17 selection probability of light paths, 18 two-sided (0 or 1), 19 selection probability of
///             next-event estimation without a guide; with a light tree, of lights at infinity alone
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
  kLightDirectSelect = 19
};

/// Slots of the record of a light that moves which change: the first ones. Its steps have them at even times.
inline constexpr int kMovingFloats = 12;
/// A light that moves or bends while the shutter is open: `segments` + 1 steps. Between two, floats change
/// evenly; normals, axes and areas follow from them.
struct MovingLight {
  size_t first = 0;      // index into LightTable::moving_steps
  int32_t segments = 0;  // a power of two; 0: it stands
};

/// What varies over an emitter's surface.
struct EmitterPattern {
  int texture = -1;         // multiplies the radiance
  FloatInput alpha{1, -1};  // multiplies what is sampled on the light; for rays see alpha_mask.h
  /// What is emitted does not get less where alpha lets rays pass (MaterialDescription::opacity).
  bool whole = false;
  float brightest = 1;  // of the texture, where that is an image
  bool unseen = false;  // no ray meets the light: it has no primitive
  /// Triangle: texture coordinates (u, v) of the corners. Sphere: the axes x, y, z of its object space.
  std::array<float, 9> frame{};
  std::array<std::array<float, 4>, 3> colors{};      // of a triangle's vertices, if scene.any_colors
  std::array<std::array<float, 2>, 3> second_uvs{};  // the same, if scene.any_second_uvs
};

/// A grid that shines (scene/lights/volume_lights.h). A point on it is drawn by a brick, then evenly within
/// that.
struct VolumeLight {
  int32_t light = 0, medium = 0;
  std::array<float, 3> first{}, cells{};  // the box of its record, in cell coordinates: where it begins, size
  std::vector<std::array<int32_t, 3>> bricks;  // those that shine, by place in the grid
  std::vector<float> keep;                     // alias method: a brick in proportion to what leaves it
  std::vector<int32_t> alias;
};

struct LightTable {
  std::vector<float> records;        // kLightFloats per light
  std::vector<int32_t> type;         // LightType per light
  std::vector<int32_t> media;        // per light: media on its sides (medium.h); empty without media
  std::vector<float> alias_keep;     // alias method of light paths: keep probability
  std::vector<int32_t> alias;        //                              other index
  std::vector<int32_t> infinite;     // indices of the infinite lights (what an escaping ray sees)
  LightTree tree;                    // empty: next-event estimation selects by power
  NextEventGuide guide;              // empty: as without a guide
  float infinity_share = 0;          // with a tree: probability of choosing from `at_infinity` instead
  std::vector<int32_t> at_infinity;  // infinite and distant lights
  // Alias method of next-event estimation, by power: of all lights, or with a tree of those `at_infinity`.
  std::vector<float> direct_keep;
  std::vector<int32_t> direct_alias;
  SharedList<EnvironmentMap> environments;
  std::vector<Portal> portals;  // of infinite lights
  // Of distant lights: where light paths start on a square across the scene in place of a disk.
  std::vector<BinnedDensity> emission_cells;
  // Where light paths go, by tables of cells of directions (emission_guide.h).
  BinnedDensity emission_guide;
  std::vector<int32_t> emission_guide_of;  // per light: its table, or -1; empty if there are none
  SharedList<EnvironmentMap> goniometers;  // of intensity
  SharedList<ProjectionMap> projectors;
  SharedList<VolumeLight> volumes;
  std::vector<EmitterPattern> patterns;  // of the emitters that do not shine evenly
  std::vector<int32_t> pattern_of;       // per light: index into patterns, or -1; empty if there are none
  std::vector<int32_t> group_of;         // per light: its light group; empty if the scene has one at most
  std::vector<RayKinds> hidden;          // per light: rays that do not see it; empty if none is hidden
  std::vector<MovingLight> moving;       // per light; empty if none moves
  std::vector<float> moving_steps;       // kMovingFloats each
  bool any_delta = false;                // lights at a point or distant ones present
  bool any_spot = false;
  bool any_sun = false;  // infinite lights that fill a cone
  bool any_flat_lamp = false, any_facing = false;
  std::vector<int32_t> lamps;  // those that paths count as they go by; the others are sampled alone
  bool any_distant = false;
  bool only_delta = true;  // nothing that a ray can hit or escape to
  bool any_sphere = false;
  bool unequal = false;    // some light has less than kUnequal of the power of another
  double total_power = 0;  // W, mean over channels, in normalised space

  /// Whether there are lights at infinity. Their paths start on a disk across the scene.
  bool any_infinite() const { return !infinite.empty() || any_distant; }
  /// Whether some light at a point shines by an image.
  bool any_imaged() const { return !goniometers.empty() || !projectors.empty(); }
  /// Whether a light path needs a random number for a texel or a cell.
  bool any_texels() const {
    return !environments.empty() || any_imaged() || !emission_cells.empty() || has_emission_guide();
  }
  /// Whether light paths of some lights go by an emission guide (training/emission_guide_training.h).
  bool has_emission_guide() const { return !emission_guide_of.empty(); }
  /// Whether next-event estimation chooses lights by their power, wherever the point is.
  bool by_power_alone() const { return tree.empty() && !guide.chooses(); }
  int32_t count() const { return static_cast<int32_t>(type.size()); }
  /// Appends a light. `power` (W, mean over channels) decides how often it is selected.
  void add(LightType light_type, const std::array<float, kLightFloats>& record, double power);
  /// Gives the last light a pattern.
  void add_pattern(const EmitterPattern& pattern);
  /// Puts the lights added since the last call into a light group. Called for all lights, or for none.
  void join_group(int32_t group) { group_of.resize(type.size(), group); }
  /// Hides the last light from rays of these kinds. From all but the camera's: it gives no light.
  void hide(RayKinds kinds);
  /// Whether the light is hidden from rays of these kinds.
  bool hides(int32_t light, RayKinds kinds) const {
    return !hidden.empty() && is_hidden(hidden[static_cast<size_t>(light)], kinds);
  }
  bool any_moving() const { return !moving.empty(); }
  /// Lets light `light` move: kMovingFloats numbers for each of segments + 1 steps. An emitter's power is
  /// that of the area that its record has until now; it gets that of its first step.
  void set_moving(int32_t light, const std::vector<float>& steps);
  /// Makes paths count the lamps. Without it they are delta lights, which only the sampling of lights finds.
  void meet_lamps();
  /// Makes a light shine no more.
  void darken(int32_t light);
  /// The record of `light` at `time` in [0, 1].
  void record_at(int32_t light, float time, float* record) const;
  /// Builds the selection tables. Call once after the last add().
  void finish();
  /// Makes light paths choose lights in proportion to `weights`.
  void choose_emitters_by(const std::vector<double>& weights);

 private:
  void build_tree();
  void widen(size_t light, LightBound* bound) const;
  std::vector<double> powers_;
};

}  // namespace lightmill
