#include "worker/render/scene/lights/emitter_builder.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/lights/emitter_pattern.h"
#include "worker/render/scene/lights/light_builder.h"
#include "worker/render/scene/textures/procedural.h"

namespace lightmill {
namespace {

/// Texture look-ups that all means of a scene may cost together, and those that one may.
constexpr double kLookups = 0x1p22, kLookupsOfOne = 0x1p18;
/// Texels that may be looked at to find that a triangle shows none that is lit, at least.
constexpr double kFewTexels = 256;
/// Side of the grid of look-ups where a texture has no texels.
constexpr double kProceduralSide = 16;
/// Part of its image's mean that an emitter's is at least: a mean of samples may miss what is bright, and
/// then the light must still be chosen at times.
constexpr double kLeastPart = 0x1p-10;
/// As for environments: filters leave small negative values beside bright texels.
constexpr float kRinging = 0.01f;

double mean(const Rgb& c) { return (double{c.r} + c.g + c.b) / 3; }

bool patterned(const SceneDescription& scene, const ShapeDescription& s) {
  return s.area_light >= 0 &&
         (scene.area_lights[static_cast<size_t>(s.area_light)].texture >= 0 || has_alpha_mask(s.alpha));
}

/// Throws unless `image` is one of radiance.
void require_radiance(const ImageContent& image, const std::string& path) {
  const auto refuse = [&](int x, int y, const char* what) {
    throw Error(ErrorKind::kBadScene, path + ": texel (" + std::to_string(x) + ", " + std::to_string(y) +
                                          ") of the emission image is " + what +
                                          "; paint it over or clamp the image");
  };
  if (image.not_finite_x >= 0)
    refuse(image.not_finite_x, image.not_finite_y, image.is_nan ? "not a number" : "infinite");
  if (image.darkest < -kRinging * image.brightest) refuse(image.darkest_x, image.darkest_y, "negative");
}

}  // namespace

EmitterBuilder::EmitterBuilder(const SceneDescription& description, RenderScene* scene)
    : in_(description), out_(*scene), sources_(description.area_lights.size()) {}

void EmitterBuilder::expect(const std::vector<const ShapeDescription*>& shapes) {
  double count = 0;
  for (const ShapeDescription* s : shapes) {
    if (!patterned(in_, *s)) continue;
    const auto* mesh = std::get_if<MeshShape>(&s->kind);
    count += mesh ? static_cast<double>(mesh->mesh->triangles.size()) : 1;
  }
  samples_ = std::clamp(kLookups / std::max(count, 1.0), 4.0, kLookupsOfOne);
}

const EmitterBuilder::Source& EmitterBuilder::source(int area_light) {
  std::optional<Source>& slot = sources_[static_cast<size_t>(area_light)];
  if (slot) return *slot;
  const AreaLightDescription& light = in_.area_lights[static_cast<size_t>(area_light)];
  Source s;
  s.radiance = light.radiance;
  s.least_mean = kLeastPart;
  try {
    if (light.texture >= 0) take_image(light, &s);
  } catch (const Error& e) {
    if (light.location.file.empty()) throw;
    throw Error(e.kind(), place(light.location) + e.what());
  }
  slot = s;
  return *slot;
}

/// What the image of `light` says of it, if its texture is one.
void EmitterBuilder::take_image(const AreaLightDescription& light, Source* s) const {
  const ImageMap* image = out_.textures.image(light.texture);
  if (!image) return;
  const std::string& path =
      std::get<ImageTexture>(in_.textures[static_cast<size_t>(light.texture)].kind).path;
  const ImageContent content = image->content();
  require_radiance(content, path);
  s->width = content.width;
  s->height = content.height;
  s->brightest = content.brightest;
  s->least_mean = kLeastPart * mean(content.mean);
  if (!(content.brightest > 0)) {
    s->radiance = {};
    return;
  }
  double divisor = 1;
  if (light.of_mean_luminance) {
    const Rgb& c = content.mean;
    divisor = 0.2126 * double{c.r} + 0.7152 * double{c.g} + 0.0722 * double{c.b};
  }
  for (float* x : {&s->radiance.r, &s->radiance.g, &s->radiance.b}) {
    *x = static_cast<float>(double{*x} / divisor);
    if (!std::isfinite(*x * content.brightest)) {
      throw Error(ErrorKind::kBadScene,
                  path + ": the emitter is brighter than float can hold; lower its \"scale\"");
    }
  }
}

/// Whether all that a triangle shows of its image is black, as far as that is found with few look-ups: most
/// triangles of a model are dark where its image has a few lit windows.
bool EmitterBuilder::shows_black(LightType type, const EmitterPattern& pattern) const {
  if (type != kTriangleLight || pattern.texture < 0) return false;
  const ImageMap* image = out_.textures.image(pattern.texture);
  if (!image) return false;
  const auto& texture = std::get<ImageTexture>(in_.textures[static_cast<size_t>(pattern.texture)].kind);
  if (texture.mapping.kind != MappingKind::kUv) return false;
  const auto corner = [&](size_t k) {
    return texture.second_uvs ? pattern.second_uvs[k]
                              : std::array<float, 2>{pattern.frame[2 * k], pattern.frame[2 * k + 1]};
  };
  float s[3], t[3];
  for (size_t k = 0; k < 3; ++k) {
    const auto uv = corner(k);
    const MappedPoint m = map_point(texture.mapping, {uv[0], uv[1], {}});
    s[k] = m.s, t[k] = m.t;
  }
  const auto [s0, s1] = std::minmax({s[0], s[1], s[2]});
  const auto [t0, t1] = std::minmax({t[0], t[1], t[2]});
  return image->brightest(s0, s1, t0, t1, std::max(samples_, kFewTexels)) <= 0;
}

/// What the emitter's radiance is multiplied by: its mean over area and channels, and the most of any point.
EmitterBuilder::Factor EmitterBuilder::factor(LightType type, const Source& source,
                                              const EmitterPattern& pattern,
                                              const std::array<float, kLightFloats>& r) const {
  const auto& f = pattern.frame;
  double side = kProceduralSide;
  if (pattern.texture < 0 && pattern.alpha.texture < 0) side = 1;
  if (source.width > 0) {
    side = type == kSphereLight ? std::max(source.width, source.height) : 1;
    for (size_t k = 0; type == kTriangleLight && k < 6; k += 2) {
      const size_t n = (k + 2) % 6;
      side = std::max({side, std::fabs(double{f[n]} - f[k]) * source.width,
                       std::fabs(double{f[n + 1]} - f[k + 1]) * source.height});
    }
    if (pattern.alpha.texture >= 0) side = std::max(side, kProceduralSide);
  }
  const auto n = static_cast<int>(std::ceil(std::min(side, std::floor(std::sqrt(samples_)))));
  float most = 0;
  const auto value = [&](float b1, float b2, const Vec3<float>& normal) {
    Vec3<float> p{r[0], r[1], r[2]};
    if (type == kSphereLight) {
      p = p + normal * r[3];
    } else {
      p = p + Vec3<float>{r[3], r[4], r[5]} * b1 + Vec3<float>{r[6], r[7], r[8]} * b2;
    }
    const Vec3<float> c = pattern_at_sample(out_, pattern, type == kSphereLight, b1, b2, normal, p);
    most = std::max(most, max_component(c));
    return mean({c.x, c.y, c.z});
  };
  const double step = 1.0 / n;
  const auto at = [&](double x, double y) {
    return value(static_cast<float>(x * step), static_cast<float>(y * step), {});
  };
  double sum = 0;
  for (int y = 0; y < n; ++y) {
    if (type == kSphereLight) {
      for (int x = 0; x < n; ++x)
        sum += value(
            0, 0,
            square_to_sphere(static_cast<float>((y + 0.5) * step), static_cast<float>((x + 0.5) * step)));
      continue;
    }
    // The centres of the n^2 equal triangles that make up the whole: upright ones, and those between them.
    for (int x = 0; x < n - y; ++x) {
      sum += at(x + 1.0 / 3, y + 1.0 / 3);
      if (x + y < n - 1) sum += at(x + 2.0 / 3, y + 2.0 / 3);
    }
  }
  return {sum / (static_cast<double>(n) * n), most};
}

int32_t EmitterBuilder::add(LightType type, const ShapeDescription& shape, double area,
                            std::array<float, kLightFloats>& record, const std::array<float, 9>& frame,
                            const int32_t* vertices, bool unseen) {
  const AreaLightDescription& light = in_.area_lights[static_cast<size_t>(shape.area_light)];
  const Source& from = source(shape.area_light);
  if (is_black(from.radiance)) return -1;
  const auto normalised = [&](float x) { return std::ldexp(x, -out_.light_exponent); };
  const Rgb radiance{normalised(from.radiance.r), normalised(from.radiance.g), normalised(from.radiance.b)};
  record[kLightRadiance] = radiance.r;
  record[kLightRadiance + 1] = radiance.g;
  record[kLightRadiance + 2] = radiance.b;
  record[kLightArea] = static_cast<float>(area);
  record[kLightTwoSided] = light.two_sided ? 1 : 0;
  double power = M_PI * area * mean(radiance) * (light.two_sided ? 2 : 1);
  if (!patterned(in_, shape) && !unseen) {
    out_.lights.add(type, record, power);
    out_.join_light_group(light.light_group);
    out_.lights.hide(shape.hidden);
    return out_.lights.count() - 1;
  }
  EmitterPattern pattern{light.texture, shape.alpha, false, from.brightest, unseen, frame, {}, {}};
  if (shape.material >= 0) {
    const FloatInput& opacity = in_.materials[static_cast<size_t>(shape.material)].opacity;
    pattern.whole = opacity.texture >= 0 || opacity.value < 1;
  }
  if (vertices && out_.any_colors) {
    for (size_t k = 0; k < 3; ++k)
      std::copy_n(&out_.colors[static_cast<size_t>(vertices[k]) * 4], 4, pattern.colors[k].begin());
  }
  if (vertices && out_.any_second_uvs) {
    for (size_t k = 0; k < 3; ++k)
      std::copy_n(&out_.second_uvs[static_cast<size_t>(vertices[k]) * 2], 2, pattern.second_uvs[k].begin());
  }
  if (is_unseen_emitter(shape)) pattern.alpha = {1, -1};
  if (shows_black(type, pattern)) return -1;
  any_texture_ = any_texture_ || pattern.texture >= 0 || pattern.alpha.texture >= 0;
  const Factor shown = factor(type, from, pattern, record);
  if (from.width == 0) pattern.brightest = std::max(1.0f, shown.most);  // as far as is known without texels
  power *= std::max(shown.mean, from.least_mean);
  out_.lights.add(type, record, power);
  out_.lights.add_pattern(pattern);
  out_.join_light_group(light.light_group);
  out_.lights.hide(shape.hidden);
  return out_.lights.count() - 1;
}

/// +1 if the emitting side is that of the winding, else -1.
double EmitterBuilder::emitting_side(const EmittingTriangle& t) const {
  if (out_.any_normals) {
    // The side of the vertex normals, as at intersection.
    double along = 0;
    for (int k = 0; k < 3; ++k) {
      const float* n = &out_.normals[static_cast<size_t>(t.vertices[k]) * 3];
      along += n[0] * t.winding.x + n[1] * t.winding.y + n[2] * t.winding.z;
    }
    if (along != 0) return along < 0 ? -1 : 1;
  }
  return t.flags & RenderScene::kFlip ? -1 : 1;
}

void EmitterBuilder::count_copy(const ShapeDescription& shape) {
  if (copied_.empty() || copied_.back().first != &shape) copied_.emplace_back(&shape, 0);
  ++copied_.back().second;
}

bool EmitterBuilder::is_copy(const ShapeDescription& shape, const EmittingTriangle& t) {
  const AreaLightDescription& light = in_.area_lights[static_cast<size_t>(shape.area_light)];
  if (is_black(light.radiance) || t.unseen) return false;
  std::array<std::array<float, 3>, 3> p;
  for (size_t k = 0; k < 3; ++k)
    std::copy_n(&out_.positions[static_cast<size_t>(t.vertices[k]) * 3], 3, p[k].begin());
  unsigned sides = emitting_side(t) > 0 ? EmitterCopies::kFront : EmitterCopies::kBack;
  if (light.two_sided) sides = EmitterCopies::kFront | EmitterCopies::kBack;
  if (!copies_.triangle(p, sides)) return false;
  count_copy(shape);
  return true;
}

bool EmitterBuilder::is_copied_sphere(const ShapeDescription& shape) {
  const AreaLightDescription& light = in_.area_lights[static_cast<size_t>(shape.area_light)];
  if (is_black(light.radiance) || is_unseen_emitter(shape) ||
      !copies_.sphere(&*(out_.spheres.end() - 4), !shape.reverse_orientation))
    return false;
  count_copy(shape);
  return true;
}

void EmitterBuilder::report() {
  for (const auto& [shape, count] : copied_) {
    out_.warnings.push_back({shape->location, Severity::kWarning,
                             (count == 1 ? std::string("an emitter of the shape lies")
                                         : std::to_string(count) + " emitters of the shape lie") +
                                 " exactly on another one, which hides it; that one alone is rendered"});
  }
}

int32_t EmitterBuilder::add_triangle(const ShapeDescription& shape, const EmittingTriangle& t) {
  const double sign = emitting_side(t);
  const int32_t* i = t.vertices;
  std::array<float, kLightFloats> r{};
  for (size_t c = 0; c < 3; ++c) {
    const float v0 = out_.positions[static_cast<size_t>(i[0]) * 3 + c];
    r[kLightP + c] = v0;
    r[kLightE1 + c] = out_.positions[static_cast<size_t>(i[1]) * 3 + c] - v0;
    r[kLightE2 + c] = out_.positions[static_cast<size_t>(i[2]) * 3 + c] - v0;
  }
  r[kLightN] = static_cast<float>(sign * t.winding.x);
  r[kLightN + 1] = static_cast<float>(sign * t.winding.y);
  r[kLightN + 2] = static_cast<float>(sign * t.winding.z);
  std::array<float, 9> uv{0, 0, 1, 0, 1, 1};  // without coordinates: as CornerUv
  if (t.flags & RenderScene::kHasUv) {
    for (size_t k = 0; k < 3; ++k) std::copy_n(&out_.uvs[static_cast<size_t>(i[k]) * 2], 2, &uv[2 * k]);
  }
  return add(kTriangleLight, shape, t.area, r, uv, i, t.unseen);
}

int32_t EmitterBuilder::add_sphere(const ShapeDescription& shape) {
  std::array<float, kLightFloats> r{};
  std::copy(out_.spheres.end() - 4, out_.spheres.end(), r.begin());
  r[kLightOrientation] = shape.reverse_orientation ? -1 : 1;
  std::array<float, 9> axes;
  std::copy(out_.sphere_axes.end() - 9, out_.sphere_axes.end(), axes.begin());
  return add(kSphereLight, shape, 4 * M_PI * double{r[3]} * r[3], r, axes, nullptr, is_unseen_emitter(shape));
}

}  // namespace lightmill
