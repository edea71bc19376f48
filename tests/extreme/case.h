#pragma once
// A case of the extreme suite: a scene whose answer is known in closed form, at one end of a range.
//
// Which sets of strategy families can see all light of a case follows from its `Sight`; the runner renders
// every set that it is asked for and that can.
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "common/job/settings.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {

/// Which families can make paths of no, of one, and of more scattering events, each on its own.
struct Sight {
  Strategies none = 0, one = 0, more = 0;
  int first = 0, last = 1;  // scattering events of the paths that the answer counts

  /// Every path of the answer can be made by a member of `set`.
  bool covered_by(Strategies set) const;
};

/// Paths of `first` to `last` events to lights of a kind, by diffuse surfaces.
Sight area_light_sight(int first, int last);
Sight delta_light_sight(int first, int last);
Sight far_light_sight(int first, int last);  // the environment
/// Through specular surfaces: camera paths that hit the emitter.
Sight specular_sight();
/// What emitter hits alone find, such as the light of media, on paths of up to `last` events.
Sight only_hits(int last);
/// The same without light tracing: the view is too small for a light path to meet it.
Sight without_lens(Sight sight);

/// A scene and its answer.
struct Setup {
  SceneDescription scene;
  int max_depth = 1;
  std::array<double, 3> exact{};  // mean radiance over the film, per channel
  double oracle_error = 1e-5;     // relative: float rounding of the renderer, or of the answer's quadrature
};

/// What a row reports: of the three channels, the one with the largest |z|.
struct Measurement {
  double exact = 0, measured = 0, standard_error = 0;
  double z = 0;  // normal deviate of the same probability as Student's t
  double effective_samples = 0;
  uint64_t nonfinite = 0;
  int channel = 0;
  Image picture;
};

/// Sets without any of `needs` are an exception, and why.
struct Note {
  /// Known: the row is measured and shown, and its failure does not fail the suite: a limitation of the
  /// renderer that `why` names.
  enum Kind { kNoisy, kSkip, kKnown };
  Kind kind;
  Strategies needs;
  std::string why;
};

struct Case {
  std::string name;       // "1 closed box"
  std::string parameter;  // "rho 0.999, depth 1000"
  std::string oracle;     // the formula
  Sight sight;
  std::function<Setup()> build;
  bool every_set = false;  // all 15 sets of families even at small size
  bool pt_only = false;    // at small size: the paths are long
  bool full_only = false;  // not at small size at all
  std::vector<Note> notes{};
  /// In place of rendering a mean: the whole measurement of integrator `i` ("bits equal", exact sums).
  std::function<Measurement(Integrator i)> measure{};
};

/// A parameter for people: 7 significant digits.
std::string text(double x);
/// Grey answer.
inline std::array<double, 3> grey(double x) { return {x, x, x}; }

// One file per family of oracles. Their numbers: 1 closed emissive box, 2 convex object in an environment,
// 3 glass in an environment, 4 inside glass, 5 sphere around a point light, 6 concentric spheres, 7 point
// light over a plane, 8 sphere light, 9 disk, 10 polygon, 11 corner, 12 sun, 13 mirrors, 14 slab, 15 GGX, 16
// emissive wall, 17 scale, 18 to 21 media, 22 to 24 light that a surface sends to itself, hidden lamps,
// narrow cones, 25 to 28 media that vary over a grid.
std::vector<Case> enclosure_cases();
std::vector<Case> direct_light_cases();
std::vector<Case> near_light_cases();
std::vector<Case> specular_cases();
std::vector<Case> range_cases();
std::vector<Case> contact_cases();
std::vector<Case> coincident_cases();
std::vector<Case> identity_cases();
std::vector<Case> odd_cases();
std::vector<Case> media_cases();
std::vector<Case> own_light_cases();
std::vector<Case> volume_cases();

}  // namespace lightmill::test
