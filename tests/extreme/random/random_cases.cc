#include "tests/extreme/random/random_cases.h"

#include <cmath>

#include "tests/extreme/random/families.h"

namespace lightmill::test {
namespace {

struct Family {
  RandomScene (*draw)(Draw&);
  /// Where a hidden lamp has room without being in the way, and its radius; none if that is 0.
  Vec3d free{};
  double room = 0;
};

const std::vector<Family>& families() {
  static const std::vector<Family> all{{closed_emitter, {20, 5, 3}, 2},
                                       {convex_in_sky},
                                       {emitting_bowl},
                                       {glass_in_sky},
                                       {point_over_floor, {5, -10, 5}, 1},
                                       {spot_over_floor, {5, -10, 5}, 1},
                                       {sphere_over_floor, {5, -10, 5}, 1},
                                       {sun_over_floor, {5, -10, 5}, 1},
                                       {slabs, {5, 5, 0.5}, 0.5},
                                       {nested_boxes, {5, 5, 0.5}, 0.5},
                                       {furnace_of_media}};
  return all;
}

RandomScene draw_scene(uint64_t seed, int number) {
  Draw d(seed * 1000003 + static_cast<uint64_t>(number));
  const Family& family = families()[static_cast<size_t>(number) % families().size()];
  RandomScene s = family.draw(d);
  if (family.room > 0 && d.coin()) hide_lamp(d, family.free, family.room, &s);
  if (d.coin()) {
    const double factor = d.decades(-12, 12);
    brighten(factor, &s);
    s.said += ", light " + text(factor);
  }
  if (d.coin()) {
    const double scale = d.decades(-6, 6), away = d.coin() ? 0 : d.decades(0, 3);
    place(scale, d.uniform(0, 360), d.direction(), d.direction() * (scale * away), &s.test.scene);
    s.said += ", scale " + text(scale) + ", off the origin " + text(away);
  }
  return s;
}

}  // namespace

std::vector<Case> random_cases(uint64_t seed, int first, int count) {
  std::vector<Case> cases;
  for (int i = first; i < first + count; ++i) {
    const RandomScene drawn = draw_scene(seed, i);
    Case c{std::to_string(i) + " " + drawn.family, drawn.said, "", drawn.sight, [seed, i] {
             const RandomScene s = draw_scene(seed, i);
             return Setup{s.test.scene, s.max_depth, s.exact, s.oracle_error};
           }};
    cases.push_back(std::move(c));
  }
  return cases;
}

std::vector<Run> random_runs(const Case& subject) {
  std::vector<Run> runs;
  for (Run& run : runs_that_see(subject.sight, false)) {
    if (!run.strategies) runs.push_back(std::move(run));
  }
  runs.push_back({"auto", Integrator::kAuto});
  return runs;
}

double largest_z(size_t rows) {
  return normal_deviate(kFalseAlarm / (3 * static_cast<double>(std::max<size_t>(rows, 1))));
}

}  // namespace lightmill::test
