#include "worker/render/scene/texture.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/parallel.h"
#include "worker/render/scene/procedural.h"

namespace lightmill {
namespace {

/// Largest accepted side of a texture, in texels.
constexpr int kMaxTextureSide = 32768;
/// A small file may unpack to many: what its header says is refused before anything of that size is made.
constexpr int64_t kMaxTexels = int64_t{1} << 28;
constexpr int kMaxChannels = 64;

float srgb_to_linear(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

/// Index into [0, n) under the wrap mode, or -1 for black.
int wrap_index(int i, int n, Wrap wrap) {
  switch (wrap) {
    case Wrap::kRepeat:
      i %= n;
      return i < 0 ? i + n : i;
    case Wrap::kMirror:
      i %= 2 * n;
      i = i < 0 ? i + 2 * n : i;
      return i < n ? i : 2 * n - 1 - i;
    case Wrap::kBlack:
      return i < 0 || i >= n ? -1 : i;
    case Wrap::kClamp:
    case Wrap::kOctahedral:
      return std::clamp(i, 0, n - 1);
  }
  return -1;
}

struct ChannelRange {
  int begin, end;
};

/// Which of a file's channels make the texels; none if alpha is asked for and there is none.
ChannelRange channels_to_read(ImageChannel channel, int in_file) {
  const bool grey = in_file < 3;  // grey, or grey and alpha
  switch (channel) {
    case ImageChannel::kRgb:
      return {0, grey ? 1 : 3};
    case ImageChannel::kRed:
      return {0, 1};
    case ImageChannel::kGreen:
      return grey ? ChannelRange{0, 1} : ChannelRange{1, 2};
    case ImageChannel::kBlue:
      return grey ? ChannelRange{0, 1} : ChannelRange{2, 3};
    case ImageChannel::kAlpha:
      return in_file == 2 || in_file > 3 ? ChannelRange{grey ? 1 : 3, grey ? 2 : 4} : ChannelRange{0, 0};
  }
  return {0, 0};
}

}  // namespace

ImageMap::ImageMap(const ImageTexture& texture)
    : wrap_(texture.wrap),
      wrap_t_(texture.wrap_t.value_or(texture.wrap)),
      scale_(texture.scale),
      invert_(texture.invert),
      nearest_(texture.nearest) {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
  if (texture.contents)
    memory =
        std::make_unique<OIIO::Filesystem::IOMemReader>(texture.contents->data(), texture.contents->size());
  OIIO::ImageSpec as_stored;
  as_stored.attribute("oiio:UnassociatedAlpha", 1);  // colours not multiplied by alpha
  // Readers take what they read from of the configuration, once there is one.
  OIIO::Filesystem::IOProxy* proxy = memory.get();
  if (proxy) as_stored.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  auto in = OIIO::ImageInput::open(texture.path, &as_stored, proxy);
  if (!in) {
    throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: " + OIIO::geterror());
  }
  const OIIO::ImageSpec spec = in->spec();
  if (spec.width < 1 || spec.height < 1 || spec.width > kMaxTextureSide || spec.height > kMaxTextureSide ||
      spec.nchannels < 1 || spec.nchannels > kMaxChannels || int64_t{spec.width} * spec.height > kMaxTexels) {
    throw Error(ErrorKind::kBadScene, texture.path + ": texture size is not supported; at most " +
                                          std::to_string(kMaxTextureSide) + " a side, " +
                                          std::to_string(kMaxTexels) + " texels and " +
                                          std::to_string(kMaxChannels) + " channels");
  }
  width_ = spec.width;
  height_ = spec.height;
  const size_t texels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  const ChannelRange take = channels_to_read(texture.channel, spec.nchannels);
  const size_t read = static_cast<size_t>(take.end - take.begin);
  channels_ = texture.channel == ImageChannel::kRgb ? 3 : 1;
  const bool bytes = spec.format == OIIO::TypeDesc::UINT8;
  auto fill = [&](auto& out, OIIO::TypeDesc type) {
    if (read == 0) {  // no alpha: opaque
      out.assign(texels, bytes ? 255 : 1);
      return true;
    }
    using Value = typename std::decay_t<decltype(out)>::value_type;
    std::vector<Value> raw(texels * read);
    const bool ok = in->read_image(0, 0, take.begin, take.end, type, raw.data());
    if (read == channels_) {
      out = std::move(raw);
      return ok;
    }
    out.resize(texels * channels_);  // a grey, with or without alpha, spread over three
    for (size_t i = 0; i < texels * channels_; ++i) out[i] = raw[i / channels_ * read];
    return ok;
  };
  const bool ok = bytes ? fill(bytes_, OIIO::TypeDesc::UINT8) : fill(floats_, OIIO::TypeDesc::FLOAT);
  if (!ok) throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: " + in->geterror());
  ColorEncoding encoding = texture.encoding;
  if (encoding == ColorEncoding::kAuto) encoding = bytes ? ColorEncoding::kSrgb : ColorEncoding::kLinear;
  auto decode = [&](float x) {
    if (encoding == ColorEncoding::kSrgb) return srgb_to_linear(x);
    if (encoding == ColorEncoding::kGamma) return std::pow(x, texture.gamma);
    return x;
  };
  for (int i = 0; i < 256; ++i) decode_[i] = decode(static_cast<float>(i) / 255.0f);
  for (float& x : floats_) {
    if (!std::isfinite(x)) {
      if (not_finite_ < 0) {
        not_finite_ = &x - floats_.data();
        is_nan_ = std::isnan(x);
      }
      x = 0;
    }
    if (encoding != ColorEncoding::kLinear) x = decode(std::max(x, 0.0f));
  }
}

Rgb ImageMap::texel(int x, int y) const {
  x = wrap_index(x, width_, wrap_);
  y = wrap_index(y, height_, wrap_t_);
  if (x < 0 || y < 0) return {};
  const size_t i =
      channels_ * (static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x));
  if (channels_ == 1) {
    const float grey = bytes_.empty() ? floats_[i] : decode_[bytes_[i]];
    return {grey, grey, grey};
  }
  if (!bytes_.empty()) return {decode_[bytes_[i]], decode_[bytes_[i + 1]], decode_[bytes_[i + 2]]};
  return {floats_[i], floats_[i + 1], floats_[i + 2]};
}

ImageContent ImageMap::content() const {
  ImageContent c;
  c.width = width_;
  c.height = height_;
  double sum[3] = {};
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Rgb t = texel(x, y);
      const float rgb[3] = {t.r * scale_, t.g * scale_, t.b * scale_};
      for (int k = 0; k < 3; ++k) {
        sum[k] += std::max(rgb[k], 0.0f);
        c.brightest = std::max(c.brightest, rgb[k]);
        if (rgb[k] < c.darkest) {
          c.darkest = rgb[k];
          c.darkest_x = x;
          c.darkest_y = y;
        }
      }
    }
  }
  const double n = static_cast<double>(width_) * height_;
  c.mean = {static_cast<float>(sum[0] / n), static_cast<float>(sum[1] / n), static_cast<float>(sum[2] / n)};
  if (const auto texel = first_not_finite()) {
    c.not_finite_x = (*texel)[0];
    c.not_finite_y = (*texel)[1];
    c.is_nan = is_nan_;
  }
  return c;
}

std::pair<float, float> ImageMap::range() const {
  float low = 0, high = std::max(scale_, 0.0f);
  if (bytes_.empty()) {
    const ImageContent c = content();
    low = c.darkest;
    high = c.brightest;
  }
  if (invert_) return {std::max(0.0f, 1 - high), std::max(0.0f, 1 - low)};
  return {low, high};
}

int64_t ImageMap::inward_normals() const {
  constexpr float kRounding = 0.01f;  // a byte of 127 is level
  int64_t count = 0;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Rgb t = texel(x, y);
      const float nx = 2 * t.r - 1, ny = 2 * t.g - 1, nz = 2 * t.b - 1;
      count += nz < -kRounding || nx * nx + ny * ny + nz * nz < kRounding;
    }
  }
  return count;
}

std::optional<std::array<int, 2>> ImageMap::first_not_finite() const {
  if (not_finite_ < 0) return std::nullopt;
  const auto texel = not_finite_ / static_cast<ptrdiff_t>(channels_);
  return std::array<int, 2>{static_cast<int>(texel % width_), static_cast<int>(texel / width_)};
}

float ImageMap::brightest(float s0, float s1, float t0, float t1, double limit) const {
  const double x0 = std::floor(double{s0} * width_ - 0.5), x1 = std::floor(double{s1} * width_ - 0.5) + 1;
  const double y0 = std::floor((1.0 - t1) * height_ - 0.5), y1 = std::floor((1.0 - t0) * height_ - 0.5) + 1;
  // Written so that NaN is too much; look-ups round, hence a texel more a side.
  if (invert_ || !((x1 - x0 + 3) * (y1 - y0 + 3) <= limit) || !(std::fabs(x0) + std::fabs(y0) < 1e6))
    return std::numeric_limits<float>::infinity();
  float most = 0;
  for (int y = static_cast<int>(y0) - 1; y <= static_cast<int>(y1) + 1; ++y) {
    for (int x = static_cast<int>(x0) - 1; x <= static_cast<int>(x1) + 1; ++x) {
      const Rgb c = texel(x, y);
      most = std::max({most, c.r * scale_, c.g * scale_, c.b * scale_});
    }
  }
  return most;
}

Rgb ImageMap::lookup(float s, float t) const {
  if (!(std::fabs(s) < 1e6f && std::fabs(t) < 1e6f)) s = t = 0;  // uv out of any meaningful range
  const float x = s * static_cast<float>(width_) - 0.5f;
  const float y = (1.0f - t) * static_cast<float>(height_) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const float wx = nearest_ ? std::round(x - fx) : x - fx, wy = nearest_ ? std::round(y - fy) : y - fy;
  const Rgb a = texel(ix, iy), b = texel(ix + 1, iy), c = texel(ix, iy + 1), d = texel(ix + 1, iy + 1);
  auto mix = [&](float p, float q, float r, float u) {
    const float top = p + (q - p) * wx, bottom = r + (u - r) * wx;
    float v = top + (bottom - top) * wy;
    v *= scale_;
    return invert_ ? std::max(0.0f, 1.0f - v) : v;
  };
  return {mix(a.r, b.r, c.r, d.r), mix(a.g, b.g, c.g, d.g), mix(a.b, b.b, c.b, d.b)};
}

TextureTable::TextureTable(const std::vector<TextureDescription>& textures, int threads) {
  std::vector<const TextureDescription*> with_image;
  for (const TextureDescription& t : textures) {
    nodes_.push_back(t.kind);
    const bool image = std::holds_alternative<ImageTexture>(t.kind);
    image_of_.push_back(image ? static_cast<int>(with_image.size()) : -1);
    if (image) with_image.push_back(&t);
  }
  std::vector<std::optional<ImageMap>> images(with_image.size());
  parallel_for(images.size(), threads, [&](size_t i) {
    try {
      images[i].emplace(std::get<ImageTexture>(with_image[i]->kind));
    } catch (const Error& e) {
      const SourceLocation& l = with_image[i]->location;
      if (l.file.empty()) throw;
      throw Error(e.kind(),
                  l.file + ":" + std::to_string(l.line) + ":" + std::to_string(l.column) + ": " + e.what());
    }
  });
  for (std::optional<ImageMap>& image : images) images_.push_back(std::move(*image));
}

Rgb TextureTable::input(const SpectrumInput& in, const TexturePoint& at) const {
  return in.texture < 0 ? in.value : evaluate(in.texture, at);
}

Rgb TextureTable::evaluate(int id, const TexturePoint& at) const {
  const auto index = static_cast<size_t>(id);
  const TextureKind& node = nodes_[index];
  auto grey = [&](const FloatInput& in) { return in.texture < 0 ? in.value : evaluate(in.texture, at).r; };
  if (const auto* t = std::get_if<ImageTexture>(&node)) {
    const MappedPoint m = map_point(t->mapping, at);
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
  return noise_color(std::get<NoiseTexture>(node), at);
}

}  // namespace lightmill
