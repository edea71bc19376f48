#include "worker/render/scene/textures/texture.h"

#include <algorithm>
#include <optional>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/image/qoi_file.h"
#include "worker/render/scene/textures/graph/graph_program.h"
#include "worker/render/scene/textures/procedural.h"
#include "worker/render/scene/textures/webp_image.h"

namespace lightmill {

namespace {

/// Which images, of these sizes, are kept in memory so that all that is kept, and a cache for the others,
/// take up to `max_bytes`. `always` are those that no cache can read.
std::vector<bool> kept_images(const std::vector<uint64_t>& bytes, const std::vector<bool>& always,
                              uint64_t max_bytes) {
  uint64_t all = 0, needed = 0;
  for (size_t i = 0; i < bytes.size(); ++i) {
    all += bytes[i];
    if (always[i]) needed += bytes[i];
  }
  if (all <= max_bytes) return std::vector<bool>(bytes.size(), true);
  const auto room = std::max(max_bytes, TextureCache::kLeastBytes) - TextureCache::kLeastBytes;
  const auto mebibytes = [](uint64_t b) { return std::to_string((b + (1 << 20) - 1) >> 20) + " MiB"; };
  if (needed > room && needed > 0) {
    throw Error(ErrorKind::kFailed, "the images inside the scene's file, and WebP and QOI images, take " +
                                        mebibytes(needed) + " of texture memory and there are " +
                                        mebibytes(room) + " for them; raise --texture-memory");
  }
  // Half of what is left is the cache's.
  std::vector<bool> kept = always;
  uint64_t left = needed < room ? (room - needed) / 2 : 0;
  for (size_t i = 0; i < bytes.size(); ++i) {
    if (kept[i] || bytes[i] > left) continue;
    kept[i] = true;
    left -= bytes[i];
  }
  return kept;
}

}  // namespace

TextureTable::TextureTable(const std::vector<TextureDescription>& textures, const BuildOptions& options,
                           const std::vector<bool>& in_use) {
  const uint64_t max_bytes = options.texture_bytes;
  std::vector<const TextureDescription*> described;
  for (const TextureDescription& t : textures) {
    const bool used = in_use.empty() || in_use[nodes_.size()];
    nodes_.push_back(t.kind);
    const bool image = std::holds_alternative<ImageTexture>(t.kind);
    image_of_.push_back(image && used ? static_cast<int>(described.size()) : -1);
    if (image && used) described.push_back(&t);
    unused_images_ += image && !used;
    if (const auto* graph = std::get_if<GraphTexture>(&t.kind); graph && used) {
      graphs_.resize(textures.size());
      graphs_[nodes_.size() - 1] = std::make_shared<GraphProgram>(*graph->graph, graph->images);
      const bool used = in_use.empty() || in_use[nodes_.size() - 1];
      any_of_ray_ = any_of_ray_ || (used && reads_ray(*graph->graph));
    }
  }
  const auto image_at = [&](size_t i) -> const ImageTexture& {
    return std::get<ImageTexture>(described[i]->kind);
  };
  /// Runs work(i) for all images; errors get their places.
  const auto for_images = [&](const auto& work) {
    parallel_for(described.size(), options.threads, [&](size_t i) {
      try {
        work(i);
      } catch (const Error& e) {
        const SourceLocation& l = described[i]->location;
        if (l.file.empty()) throw;
        throw Error(e.kind(),
                    l.file + ":" + std::to_string(l.line) + ":" + std::to_string(l.column) + ": " + e.what());
      }
    });
  };
  std::vector<uint64_t> bytes(described.size());
  std::vector<bool> kept(described.size(), true);
  for_images([&](size_t i) { bytes[i] = ImageMap::bytes_needed(image_at(i)); });
  if (max_bytes != kUnboundedTextures) {
    std::vector<bool> inside;
    for (size_t i = 0; i < described.size(); ++i)
      inside.push_back(image_at(i).contents != nullptr || is_webp(image_at(i)) || is_qoi(image_at(i).path));
    kept = kept_images(bytes, inside, max_bytes);
  }
  for (size_t i = 0; i < bytes.size(); ++i) bytes_ += kept[i] ? bytes[i] : 0;
  if (std::find(kept.begin(), kept.end(), false) != kept.end()) {
    cache_ = std::make_unique<TextureCache>(max_bytes > bytes_ ? max_bytes - bytes_ : 0);
    bytes_ = std::max(max_bytes, bytes_ + TextureCache::kLeastBytes);
  }
  std::vector<std::optional<ImageMap>> images(described.size());
  for_images([&](size_t i) { images[i].emplace(image_at(i), kept[i] ? nullptr : cache_.get()); });
  for (std::optional<ImageMap>& image : images) images_.push_back(std::move(*image));
}

size_t TextureTable::cached_images() const {
  return static_cast<size_t>(
      std::count_if(images_.begin(), images_.end(), [](const ImageMap& image) { return image.cached(); }));
}

namespace {

/// Where an image is looked up.
MappedPoint image_point(const ImageTexture& image, const TexturePoint& at) {
  if (!image.second_uvs) return map_point(image.mapping, at);
  TexturePoint second = at;
  second.u = at.second_u, second.v = at.second_v;
  return map_point(image.mapping, second);
}

}  // namespace

Rgb TextureTable::input(const SpectrumInput& in, const TexturePoint& at) const {
  return in.texture < 0 ? in.value : evaluate(in.texture, at);
}

void TextureTable::prefetch(int id, const TexturePoint& at) const {
  const ImageMap* const map = image(id);
  if (!map) return;
  const MappedPoint m = image_point(std::get<ImageTexture>(nodes_[static_cast<size_t>(id)]), at);
  map->prefetch(m.s, m.t);
}

Rgb TextureTable::evaluate(int id, const TexturePoint& at) const {
  const auto index = static_cast<size_t>(id);
  const TextureKind& node = nodes_[index];
  auto grey = [&](const FloatInput& in) { return in.texture < 0 ? in.value : evaluate(in.texture, at).r; };
  if (const auto* t = std::get_if<ImageTexture>(&node)) {
    const MappedPoint m = image_point(*t, at);
    return images_[static_cast<size_t>(image_of_[index])].lookup(m.s, m.t);
  }
  if (const auto* t = std::get_if<ConstantTexture>(&node)) return t->value;
  if (const auto* t = std::get_if<ScaleTexture>(&node)) {
    const Rgb x = input(t->tex, at);
    const float s = grey(t->scale);
    return {x.r * s, x.g * s, x.b * s};
  }
  if (const auto* t = std::get_if<MixTexture>(&node)) {
    const float w = grey(t->amount);
    const Rgb a = input(t->tex1, at), b = input(t->tex2, at);
    return {a.r + (b.r - a.r) * w, a.g + (b.g - a.g) * w, a.b + (b.b - a.b) * w};
  }
  if (const auto* t = std::get_if<CheckerboardTexture>(&node))
    return input(second_square(*t, at) ? t->tex2 : t->tex1, at);
  if (const auto* t = std::get_if<BilerpTexture>(&node)) return bilerp(*t, at);
  if (const auto* t = std::get_if<DirectionMixTexture>(&node)) {
    const Vec3<float> towards{static_cast<float>(t->direction.x), static_cast<float>(t->direction.y),
                              static_cast<float>(t->direction.z)};
    const float w = std::min(std::fabs(dot(at.n, towards)), 1.0f);
    const Rgb a = input(t->tex1, at), b = input(t->tex2, at);
    return {b.r + (a.r - b.r) * w, b.g + (a.g - b.g) * w, b.b + (a.b - b.b) * w};
  }
  if (const auto* t = std::get_if<DotsTexture>(&node))
    return input(inside_dot(map_point(t->mapping, at)) ? t->inside : t->outside, at);
  if (const auto* t = std::get_if<ProductTexture>(&node)) {
    const Rgb a = input(t->a, at), b = input(t->b, at);
    return {a.r * b.r, a.g * b.g, a.b * b.b};
  }
  if (const auto* t = std::get_if<VertexColorTexture>(&node)) {
    const auto& c = at.color;
    return t->alpha ? Rgb{c[3], c[3], c[3]} : Rgb{c[0], c[1], c[2]};
  }
  if (const auto* t = std::get_if<StepTexture>(&node)) {
    const float x = grey(t->value) >= t->edge ? 1.0f : 0.0f;
    return {x, x, x};
  }
  if (std::holds_alternative<GraphTexture>(node)) {
    for (int i = 0; at.known && i < at.known->count; ++i) {
      if (at.known->texture[i] == id) return at.known->value[i];
    }
    float c[3];
    graphs_[index]->evaluate<float>(*this, &at, c);
    return {c[0], c[1], c[2]};
  }
  return noise_color(std::get<NoiseTexture>(node), at);
}

Vec3<float> TextureTable::normal_of_graph(int id, const Rgb& given) const {
  const auto* graph = std::get_if<GraphTexture>(&nodes_[static_cast<size_t>(id)]);
  if (!graph) return {given.r, given.g, given.b};
  // Normals turn by the inverse's transpose on the way there.
  const auto& m = graph->graph->to_world.m;
  const auto row = [&](size_t k) {
    return static_cast<float>(m[0][k] * double{given.r} + m[1][k] * double{given.g} +
                              m[2][k] * double{given.b});
  };
  return {row(0), row(1), row(2)};
}

void TextureTable::evaluate_graph(int id, const TexturePoint at[8], Rgb values[8]) const {
  Float8 c[3];
  graphs_[static_cast<size_t>(id)]->evaluate<Float8>(*this, at, c);
  for (int l = 0; l < 8; ++l) values[l] = {c[0][l], c[1][l], c[2][l]};
}

}  // namespace lightmill
