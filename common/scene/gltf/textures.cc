#include "common/scene/gltf/textures.h"

#include <cmath>

#include "common/scene/gltf/json/container.h"

namespace lightmill {
namespace {

/// An extension by which image readers know the format, from the first bytes.
std::string extension_of(const std::string& bytes) {
  if (bytes.starts_with("\x89PNG")) return ".png";
  if (bytes.starts_with("\xff\xd8")) return ".jpg";
  if (bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WEBP") return ".webp";
  // Not glTF's, but files have them.
  if (bytes.starts_with("BM")) return ".bmp";
  if (bytes.starts_with("GIF8")) return ".gif";
  if (bytes.starts_with("DDS ")) return ".dds";
  if (bytes.starts_with("qoif")) return ".qoi";
  if (bytes.starts_with("v/1\x01")) return ".exr";
  if (bytes.starts_with("#?R")) return ".hdr";
  if (bytes.starts_with("II*") || bytes.starts_with("MM")) return ".tif";
  return "";
}

Wrap wrap_mode(const GltfValue& sampler, const char* key) {
  constexpr int64_t kClampToEdge = 33071, kMirroredRepeat = 33648, kRepeat = 10497;
  const int64_t mode = static_cast<int64_t>(sampler.number_or(key, kRepeat, 0, 100'000));
  if (mode == kClampToEdge) return Wrap::kClamp;
  if (mode == kMirroredRepeat) return Wrap::kMirror;
  if (mode != kRepeat)
    sampler.mended(std::string("\"") + key + "\" is none of 10497, 33071 and 33648; the image is repeated");
  return Wrap::kRepeat;
}

/// KHR_texture_transform, its angle counter-clockwise as seen with v downwards (the way exporters and viewers
/// have it): over glTF's (u, v) with v downwards, s = c sx u + n sy v + tx and
/// t = -n sx u + c sy v + ty for c, n the rotation's cosine and sine. Ours has v and t upwards.
UvMapping mapping_of(const GltfValue& transform) {
  constexpr double kFar = 1e6;
  const auto offset = transform.numbers_or("offset", {0, 0}, -kFar, kFar);
  const auto scale = transform.numbers_or("scale", {1, 1}, -kFar, kFar);
  const double angle = transform.number_or("rotation", 0, -kFar, kFar);
  const double c = std::cos(angle), n = std::sin(angle);
  UvMapping m;
  m.su = static_cast<float>(c * scale[0]);
  m.sv_u = static_cast<float>(-n * scale[1]);
  m.du = static_cast<float>(offset[0] + n * scale[1]);
  m.su_v = static_cast<float>(n * scale[0]);
  m.sv = static_cast<float>(c * scale[1]);
  m.dv = static_cast<float>(1 - c * scale[1] - offset[1]);
  return m;
}

/// n of the TEXCOORD_n that a texture is looked up by.
int uv_set_of(const GltfValue& info) {
  constexpr double kMost = 1000;
  double set = info.number_or("texCoord", 0, 0, kMost);
  if (const auto transform = info.extension("KHR_texture_transform"))
    set = transform->number_or("texCoord", set, 0, kMost);
  return static_cast<int>(set);
}

}  // namespace

void GltfTextures::begin_material(const GltfValue& material) {
  uv_sets_ = {-1, -1};
  used_ = false;
  const auto normal = material.find_object("normalTexture");
  if (normal) uv_sets_[0] = uv_set_of(*normal);
}

const GltfTextures::Image& GltfTextures::source(size_t index) {
  if (const auto found = images_.find(index); found != images_.end()) return found->second;
  const GltfValue value = root_.require("images")[index];
  Image image;
  std::string embedded;
  const int view = value.index_or_none("bufferView", root_.count("bufferViews"), "buffer view");
  if (const auto uri = value.find("uri")) {
    try {
      const std::string text = uri->text();
      if (auto data = decode_data_uri(text)) {
        image.contents = std::make_shared<const std::string>(std::move(*data));
      } else {
        image.path = scene_.open_reference(path_of_uri(text), uri->pointer());
      }
    } catch (const GltfProblem& problem) {
      throw GltfProblem{uri->pointer(), problem.message};
    }
  } else if (view >= 0) {
    image.contents = buffers_.view_contents(static_cast<size_t>(view));
  } else {
    value.fail("needs \"uri\" or \"bufferView\"");
  }
  if (image.contents) {
    image.path = scene_.name + value.pointer() + extension_of(*image.contents);
    if (image.path.ends_with(value.pointer())) value.fail("is no PNG, JPEG or WebP image");
  }
  return images_[index] = std::move(image);
}

bool GltfTextures::is_missing(const GltfValue& image) {
  if (!scene_.missing_textures) return false;
  const auto uri = image.find("uri");
  if (!uri || decode_data_uri(uri->text()) || !scene_.files.resolve(path_of_uri(uri->text())).empty())
    return false;
  scene_.mended(uri->pointer(), "there is no file " + in_quotes(path_of_uri(uri->text())) +
                                    "; what uses it goes by its factors alone");
  return true;
}

int GltfTextures::add(TextureKind kind, const GltfValue& at, bool is_spectrum) {
  scene_.scene.textures.push_back(
      {at.pointer(), is_spectrum, std::move(kind), scene_.likely_place(at.pointer())});
  return static_cast<int>(scene_.scene.textures.size()) - 1;
}

int GltfTextures::image(const GltfValue& owner, const char* key, ImageChannel channel, bool srgb, float scale,
                        bool invert) {
  const auto info = owner.find_object(key);
  if (!info) return -1;
  int result = -1;
  scene_.attempt([&] {
    const int index = info->index_or_none("index", root_.count("textures"), "texture");
    if (index < 0) {
      info->mended("needs \"index\"; the texture is left out");
      return;
    }
    const GltfValue texture = root_.require("textures")[static_cast<size_t>(index)];
    const auto webp = texture.extension("EXT_texture_webp");
    const int source_index = (webp ? *webp : texture).index_or_none("source", root_.count("images"), "image");
    if (source_index < 0) {
      scene_.unsupported(texture.pointer(), "a texture that has images of an extension only; it is left out");
      return;
    }
    ImageTexture image;
    if (is_missing(root_.require("images")[static_cast<size_t>(source_index)])) return;
    const Image& from = source(static_cast<size_t>(source_index));
    image.path = from.path;
    image.contents = from.contents;
    image.channel = channel;
    image.encoding = srgb ? ColorEncoding::kSrgb : ColorEncoding::kLinear;
    image.scale = scale;
    image.invert = invert;
    constexpr double kNearest = 9728;
    if (const int s = texture.index_or_none("sampler", root_.count("samplers"), "sampler"); s >= 0) {
      const GltfValue sampler = root_.require("samplers")[static_cast<size_t>(s)];
      image.wrap = wrap_mode(sampler, "wrapS");
      image.wrap_t = wrap_mode(sampler, "wrapT");
      if (sampler.number_or("magFilter", 0, 0, 100'000) == kNearest) image.filter = TexelFilter::kNearest;
    }
    const int set = uv_set_of(*info);
    if (const auto transform = info->extension("KHR_texture_transform"))
      image.mapping = mapping_of(*transform);
    if (uv_sets_[0] < 0) uv_sets_[0] = set;
    if (uv_sets_[1] < 0 && set != uv_sets_[0]) uv_sets_[1] = set;
    image.second_uvs = set != uv_sets_[0];
    if (image.second_uvs && set != uv_sets_[1]) {
      scene_.unsupported(info->pointer(), "a third set of texture coordinates in one material; TEXCOORD_" +
                                              std::to_string(uv_sets_[1]) + " is used");
    }
    used_ = true;
    result = add(image, *info, channel == ImageChannel::kRgb);
  });
  return result;
}

int GltfTextures::product(int a, int b) {
  if (a < 0 || b < 0) return std::max(a, b);
  const auto& first = scene_.scene.textures[static_cast<size_t>(a)];
  TextureDescription both{first.name, first.is_spectrum, ProductTexture{{{}, a}, {{}, b}}, first.location};
  scene_.scene.textures.push_back(std::move(both));
  return static_cast<int>(scene_.scene.textures.size()) - 1;
}

SpectrumInput GltfTextures::color(const GltfValue& owner, const char* key, const Rgb& factor) {
  const int texture = image(owner, key, ImageChannel::kRgb, true);
  if (texture < 0 || factor == Rgb{1, 1, 1}) return {factor, texture};
  return {factor, add(ProductTexture{{{}, texture}, {factor, -1}}, owner, true)};
}

FloatInput GltfTextures::number(const GltfValue& owner, const char* key, ImageChannel channel, float factor) {
  return {factor, image(owner, key, channel, false, factor)};
}

}  // namespace lightmill
