#include "worker/render/scene/media/media_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/motion.h"
#include "common/scene/transform.h"
#include "worker/render/scene/media/volume_builder.h"
#include "worker/render/scene/media/volume_files.h"

namespace lightmill {
namespace {

/// Where what the grid's transform takes to the world lies at even times, from there at the first: a power of
/// two of segments, as many as its turns need. Empty if it stands still.
std::vector<Transform> way_of_grid(const MediumGrid& grid, const SceneDescription& scene) {
  std::vector<Transform> poses;
  if (grid.moves_to < 0) return poses;
  constexpr double kDegrees = 2;  // of a turn that a straight segment stands for
  constexpr int kMostSegments = 128;
  const Way way(grid.medium_to_world, grid.moves_to, scene);
  const auto between = scene.between.find(grid.moves_to);
  const int parts = between == scene.between.end() ? 1 : 4 * static_cast<int>(between->second.size() + 1);
  int segments = 1;
  while (segments < kMostSegments && (way.degrees() > kDegrees * segments || segments < parts)) segments *= 2;
  const Transform back = inverse(grid.medium_to_world);
  poses.emplace_back();
  for (int i = 1; i <= segments; ++i) poses.push_back(way.at(static_cast<double>(i) / segments) * back);
  return poses;
}

}  // namespace

MediaBuilder::MediaBuilder(const SceneDescription& description,
                           const std::vector<const ShapeDescription*>& shapes,
                           std::shared_ptr<SpillArea> area, std::vector<Problem>* warnings)
    : in_(description),
      area_(std::move(area)),
      media_(description.media),
      ways_(description.media.size()),
      number_(description.media.size(), 0) {
  std::vector<bool> used(in_.media.size(), false);
  const auto use = [&](int index) {
    if (index >= 0) used[static_cast<size_t>(index)] = true;
  };
  for (const ShapeDescription* s : shapes) {
    any_panes_ = any_panes_ || is_pane(*s);
    if (!s->media.transition() && s->area_light < 0) continue;
    use(s->media.inside);
    use(s->media.outside);
  }
  for (const LightDescription& l : in_.lights) use(l.medium);
  use(in_.camera.medium);
  for (size_t i = 0; i < used.size(); ++i) {
    if (!used[i] || is_empty(media_[i])) continue;
    number_[i] = ++count_;
    if (media_[i].grid) ways_[i] = way_of_grid(*media_[i].grid, in_);
    media_[i] = with_file_read(media_[i], area_, warnings);
  }
}

std::vector<Vec3d> MediaBuilder::grid_corners() const {
  std::vector<Vec3d> corners;
  for (size_t i = 0; i < media_.size(); ++i) {
    if (number_[i] == 0 || !media_[i].grid) continue;
    const MediumGrid& g = *media_[i].grid;
    for (int corner = 0; corner < 8; ++corner) {
      corners.push_back(transform_point(
          g.medium_to_world,
          {corner & 1 ? g.hi.x : g.lo.x, corner & 2 ? g.hi.y : g.lo.y, corner & 4 ? g.hi.z : g.lo.z}));
      const Vec3d first = corners.back();
      for (const Transform& to : ways_[i]) corners.push_back(transform_point(to, first));
    }
  }
  return corners;
}

void MediaBuilder::write(int threads, RenderScene* scene) {
  if (!any()) return;
  if (count_ > kMaxMedia)
    throw Error(ErrorKind::kBadScene,
                "the scene has more than " + std::to_string(kMaxMedia) + " media, which is the limit");
  scene->volumes.values = SpillArray<float>(area_);
  scene->media.assign((static_cast<size_t>(count_) + 1) * kMediumFloats, 0.0f);
  if (scene->light_groups.size() > 1) scene->medium_groups.resize(static_cast<size_t>(count_) + 1);
  for (size_t i = 0; i < media_.size(); ++i) {
    if (number_[i] == 0) continue;
    MediumDescription& m = media_[i];
    if (!scene->medium_groups.empty())
      scene->medium_groups[static_cast<size_t>(number_[i])] = scene->light_group_number(m.light_group);
    float* record = &scene->media[static_cast<size_t>(number_[i]) * kMediumFloats];
    const float a[3] = {m.sigma_a.r, m.sigma_a.g, m.sigma_a.b},
                s[3] = {m.sigma_s.r, m.sigma_s.g, m.sigma_s.b},
                e[3] = {m.emission.r, m.emission.g, m.emission.b};
    // Grids with coefficients of their own at every point: those of the record are not read.
    const bool own = m.grid && !m.grid->density && !m.grid->cloud;
    const bool collides = std::max({s[0], s[1], s[2]}) > 0 || own || !is_black(brightest(m));
    // Lengths are 2^scale_exponent times what they are in scene units.
    const auto scaled = [&](double x) { return static_cast<float>(std::ldexp(x, -scene->scale_exponent)); };
    double rate = 0;
    for (size_t c = 0; c < 3; ++c) {
      const double extinction = double{a[c]} + s[c];
      record[kMediumExtinction + c] = scaled(extinction);
      record[kMediumScattering + c] = scaled(s[c]);
      record[kMediumCollision + c] = collides ? scaled(extinction) : 0.0f;
      const double shown = std::ldexp(double{e[c]}, -scene->light_exponent);
      record[kMediumEmission + c] = own ? static_cast<float>(shown) : scaled(a[c] * shown);
      if (collides) rate += extinction / 3;
    }
    record[kMediumMeanRate] = scaled(rate);
    record[kMediumG] = m.g;
    record[kMediumCollides] = collides;
    // Products of two of them stay within float.
    constexpr float kLimit = 1e18f;
    if (!(*std::max_element(record, record + kMediumFloats) < kLimit)) {
      throw Error(ErrorKind::kBadScene,
                  m.location.file + ":" + std::to_string(m.location.line) + ":" +
                      std::to_string(m.location.column) + ": the medium \"" + m.name +
                      "\" is opaque within 1e-18 of the scene's extent; lower its \"scale\"");
    }
    if (m.grid)
      record[kMediumGrid] = std::bit_cast<float>(1 + add_grid(m, ways_[i], record, collides, threads, scene));
    m.grid.reset();  // large
  }
  if (area_) area_->expect_random_reads();
  scene->camera_medium = number(in_.camera.medium);
}

bool MediaBuilder::is_pane(const ShapeDescription& shape) const {
  if (shape.boundary || shape.area_light >= 0 || shape.material < 0) return false;
  const MaterialDescription& material = in_.materials[static_cast<size_t>(shape.material)];
  if (is_tinted(material)) return true;
  return std::holds_alternative<ThinDielectricMaterial>(material.kind) && material.normal_map < 0 &&
         material.displacement < 0;
}

int32_t MediaBuilder::sides(const ShapeDescription& shape) const {
  const int32_t inside = number(shape.media.inside), outside = number(shape.media.outside);
  return medium_sides(inside, outside) | (shape.media.transition() ? kMediumTransition : 0) |
         (shape.boundary || is_pane(shape) ? kMediumBoundary : 0);
}

}  // namespace lightmill
