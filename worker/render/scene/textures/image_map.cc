#include "worker/render/scene/textures/image_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/error.h"
#include "common/image/image.h"
#include "common/image/image_reader.h"
#include "common/image/qoi_file.h"
#include "worker/render/scene/textures/webp_image.h"

namespace lightmill {
namespace {

/// Largest accepted side of a texture, in texels.
constexpr int kMaxTextureSide = 32768;
/// A small file may unpack to many: what its header says is refused before anything of that size is made.
constexpr int64_t kMaxTexels = int64_t{1} << 28;
constexpr int kMaxChannels = 64;

/// Index into [0, n) under the wrap mode, or -1 for black.
int wrap_index(int i, int n, Wrap wrap) {
  if (static_cast<unsigned>(i) < static_cast<unsigned>(n)) return i;  // the usual case, without a division
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

/// An image file, opened.
struct OpenImage {
  std::optional<ImageReader> in;
  std::optional<WebpImage> webp;  // in place of it
  ImageHeader header;

  size_t texels() const { return static_cast<size_t>(header.width) * static_cast<size_t>(header.height); }

  /// Channels [begin, end) of all texels; false, and a reason, if the file is damaged.
  template <class Value>
  bool read(int begin, int end, Value* out, std::string* why) const {
    if (!webp) return in->read(begin, end, out, why);
    const std::vector<uint8_t> all = webp->pixels();
    const auto in_file = static_cast<size_t>(webp->channels), first = static_cast<size_t>(begin),
               wanted = static_cast<size_t>(end - begin);
    for (size_t i = 0; i * in_file < all.size(); ++i) {
      for (size_t c = 0; c < wanted; ++c)
        out[i * wanted + c] = static_cast<Value>(all[i * in_file + first + c]);
    }
    if (all.empty()) *why = "it is damaged";
    return !all.empty();
  }
};

/// Throws Error(kBadScene) for what is no image or not of a supported size.
OpenImage open_image(const ImageTexture& texture) {
  OpenImage image;
  image.webp = open_webp(texture);
  if (image.webp) {
    image.header = {image.webp->width, image.webp->height, 1, image.webp->channels, true, false, false};
  } else {
    ImageSource source{texture.path};
    source.as_stored = true;
    if (texture.contents) {
      source.contents = texture.contents->data();
      source.bytes = texture.contents->size();
    }
    std::string why;
    image.in = ImageReader::open(source, &why);
    if (!image.in) throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: " + why);
    image.header = image.in->header();
  }
  const ImageHeader& file = image.header;
  if (file.width < 1 || file.height < 1 || file.width > kMaxTextureSide || file.height > kMaxTextureSide ||
      file.channels < 1 || file.channels > kMaxChannels || int64_t{file.width} * file.height > kMaxTexels) {
    throw Error(ErrorKind::kBadScene, texture.path + ": texture size is not supported; at most " +
                                          std::to_string(kMaxTextureSide) + " a side, " +
                                          std::to_string(kMaxTexels) + " texels and " +
                                          std::to_string(kMaxChannels) + " channels");
  }
  return image;
}

size_t channels_of(const ImageTexture& texture) { return texture.channel == ImageChannel::kRgb ? 3 : 1; }

/// A grey, with or without alpha, spread over the channels of texels.
template <class Value>
void spread(const Value* raw, size_t texels, size_t raw_channels, size_t channels, Value* out) {
  for (size_t i = 0; i < texels * channels; ++i) out[i] = raw[i / channels * raw_channels];
}

}  // namespace

uint64_t ImageMap::bytes_needed(const ImageTexture& texture) {
  const OpenImage image = open_image(texture);
  return image.texels() * channels_of(texture) * (image.header.is_bytes ? sizeof(uint8_t) : sizeof(float));
}

ImageMap::ImageMap(const ImageTexture& texture, TextureCache* cache)
    : wrap_(texture.wrap),
      wrap_t_(texture.wrap_t.value_or(texture.wrap)),
      scale_(texture.scale),
      invert_(texture.invert),
      filter_(texture.filter),
      channels_(channels_of(texture)),
      cache_(cache),
      encoding_(texture.encoding),
      gamma_(texture.gamma) {
  const OpenImage image = open_image(texture);
  width_ = image.header.width;
  height_ = image.header.height;
  is_bytes_ = image.header.is_bytes;
  const ChannelRange take = channels_to_read(texture.channel, image.header.channels);
  first_channel_ = take.begin;
  read_channels_ = static_cast<size_t>(take.end - take.begin);
  // Floats are linear, whatever the scene says. Integers are sRGB, of 8 bits and of 16, unless the scene says
  // otherwise or (QOI) the file; what other files say is often wrong, and pbrt does not heed it.
  const bool linear = image.header.is_floating_point || (image.header.says_linear && is_qoi(texture.path));
  if (image.header.is_floating_point || encoding_ == ColorEncoding::kAuto)
    encoding_ = linear ? ColorEncoding::kLinear : ColorEncoding::kSrgb;
  for (int i = 0; i < 256; ++i) {
    const float x = static_cast<float>(i) / 255.0f;
    decode_[i] = encoding_ == ColorEncoding::kSrgb    ? srgb_to_linear(x)
                 : encoding_ == ColorEncoding::kGamma ? std::pow(x, gamma_)
                                                      : x;
  }
  if (cache_) {
    file_ = cache_->open(texture.path);
    if (!look_at_all())
      throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: it is damaged");
    return;
  }
  std::string why;
  const auto fill = [&](auto& out) {
    const size_t texels = image.texels();
    if (read_channels_ == 0) {  // no alpha: opaque
      out.assign(texels, is_bytes_ ? 255 : 1);
      return true;
    }
    std::decay_t<decltype(out)> raw(texels * read_channels_);
    if (!image.read(take.begin, take.end, raw.data(), &why)) return false;
    if (read_channels_ == channels_) {
      out = std::move(raw);
      return true;
    }
    out.resize(texels * channels_);
    spread(raw.data(), texels, read_channels_, channels_, out.data());
    return true;
  };
  const bool ok = is_bytes_ ? fill(bytes_) : fill(floats_);
  if (!ok) throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: " + why);
  const auto bad = std::find_if(floats_.begin(), floats_.end(), [](float x) { return !std::isfinite(x); });
  if (bad != floats_.end()) {
    not_finite_ = (bad - floats_.begin()) / static_cast<ptrdiff_t>(channels_);
    is_nan_ = std::isnan(*bad);
  }
  for (float& x : floats_) x = decoded(x);
}

bool ImageMap::look_at_all() {
  // One column of tiles of a row at a time, as the cache may hold little more.
  constexpr int kSide = 64;
  std::vector<float> floats(is_bytes_ ? 0 : kSide * kSide * channels_);
  std::vector<uint8_t> bytes(is_bytes_ ? kSide * kSide * channels_ : 0);
  for (int y0 = 0; y0 < height_; y0 += kSide) {
    for (int x0 = 0; x0 < width_; x0 += kSide) {
      const int x1 = std::min(x0 + kSide, width_), y1 = std::min(y0 + kSide, height_);
      if (is_bytes_) {
        if (!read_cached(x0, x1, y0, y1, bytes.data())) return false;
        continue;
      }
      if (!read_cached(x0, x1, y0, y1, floats.data())) return false;
      const size_t texels = static_cast<size_t>(x1 - x0) * static_cast<size_t>(y1 - y0);
      for (size_t i = 0; i < texels * channels_; ++i) {
        if (std::isfinite(floats[i])) continue;
        const auto texel = static_cast<int64_t>(i / channels_);
        const int64_t at = (y0 + texel / (x1 - x0)) * int64_t{width_} + x0 + texel % (x1 - x0);
        if (not_finite_ >= 0 && not_finite_ <= at) continue;
        not_finite_ = at;
        is_nan_ = std::isnan(floats[i]);
      }
    }
  }
  return true;
}

template <class Value>
bool ImageMap::read_cached(int x0, int x1, int y0, int y1, Value* out) const {
  const size_t texels = static_cast<size_t>(x1 - x0) * static_cast<size_t>(y1 - y0);
  if (read_channels_ == 0) {
    std::fill_n(out, texels, is_bytes_ ? Value(255) : Value(1));
    return true;
  }
  const bool ok = cache_->read(file_, x0, x1, y0, y1, first_channel_, static_cast<int>(read_channels_), out);
  // One channel where three are wanted: spread from the end, so that nothing is overwritten before it is
  // read.
  for (size_t i = read_channels_ == channels_ ? 0 : texels; i-- > 0;)
    std::fill_n(out + i * channels_, channels_, Value{out[i]});
  return ok;
}

float ImageMap::decoded(float stored) const {
  const float x = std::isfinite(stored) ? stored : 0.0f;
  if (encoding_ == ColorEncoding::kSrgb) return srgb_to_linear(std::max(x, 0.0f));
  if (encoding_ == ColorEncoding::kGamma) return std::pow(std::max(x, 0.0f), gamma_);
  return x;
}

Rgb ImageMap::color(const uint8_t* texel) const {
  if (channels_ == 3) return {decode_[texel[0]], decode_[texel[1]], decode_[texel[2]]};
  const float grey = decode_[texel[0]];
  return {grey, grey, grey};
}
Rgb ImageMap::color(const float* texel) const {
  return channels_ == 3 ? Rgb{texel[0], texel[1], texel[2]} : Rgb{texel[0], texel[0], texel[0]};
}

Rgb ImageMap::stored_texel(int x, int y) const {
  if (x < 0 || y < 0) return {};
  if (cache_) {
    if (is_bytes_) {
      uint8_t stored[3];
      read_cached(x, x + 1, y, y + 1, stored);
      return color(stored);
    }
    float stored[3];
    read_cached(x, x + 1, y, y + 1, stored);
    for (float& v : stored) v = decoded(v);
    return color(stored);
  }
  const size_t i = index_of(x, y);
  return is_bytes_ ? color(&bytes_[i]) : color(&floats_[i]);
}

Rgb ImageMap::texel(int x, int y) const {
  return stored_texel(wrap_index(x, width_, wrap_), wrap_index(y, height_, wrap_t_));
}

std::array<Rgb, 4> ImageMap::square(int x, int y) const {
  const int x0 = wrap_index(x, width_, wrap_), x1 = wrap_index(x + 1, width_, wrap_);
  const int y0 = wrap_index(y, height_, wrap_t_), y1 = wrap_index(y + 1, height_, wrap_t_);
  if (!cache_ || x0 < 0 || y0 < 0 || x1 != x0 + 1 || y1 != y0 + 1)
    return {stored_texel(x0, y0), stored_texel(x1, y0), stored_texel(x0, y1), stored_texel(x1, y1)};
  // The four in one call: that is most of its cost.
  std::array<Rgb, 4> out;
  if (is_bytes_) {
    uint8_t stored[12];
    read_cached(x0, x0 + 2, y0, y0 + 2, stored);
    for (size_t i = 0; i < 4; ++i) out[i] = color(stored + i * channels_);
  } else {
    float stored[12];
    read_cached(x0, x0 + 2, y0, y0 + 2, stored);
    for (size_t i = 0; i < 4 * channels_; ++i) stored[i] = decoded(stored[i]);
    for (size_t i = 0; i < 4; ++i) out[i] = color(stored + i * channels_);
  }
  return out;
}

template <class Visit>
void ImageMap::for_each_texel(const Visit& visit) const {
  if (!cache_) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) visit(x, y, texel(x, y));
    }
    return;
  }
  std::vector<uint8_t> bytes(is_bytes_ ? static_cast<size_t>(width_) * channels_ : 0);
  std::vector<float> floats(is_bytes_ ? 0 : static_cast<size_t>(width_) * channels_);
  for (int y = 0; y < height_; ++y) {
    if (is_bytes_) {
      read_cached(0, width_, y, y + 1, bytes.data());
    } else {
      read_cached(0, width_, y, y + 1, floats.data());
      for (float& v : floats) v = decoded(v);
    }
    for (int x = 0; x < width_; ++x) {
      const size_t i = static_cast<size_t>(x) * channels_;
      visit(x, y, is_bytes_ ? color(&bytes[i]) : color(&floats[i]));
    }
  }
}

ImageContent ImageMap::content() const {
  ImageContent c;
  c.width = width_;
  c.height = height_;
  double sum[3] = {};
  for_each_texel([&](int x, int y, const Rgb& t) {
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
  });
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
  if (!is_bytes_) {
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
  for_each_texel([&](int, int, const Rgb& t) {
    const float nx = 2 * t.r - 1, ny = 2 * t.g - 1, nz = 2 * t.b - 1;
    count += nz < -kRounding || nx * nx + ny * ny + nz * nz < kRounding;
  });
  return count;
}

std::optional<std::array<int, 2>> ImageMap::first_not_finite() const {
  if (not_finite_ < 0) return std::nullopt;
  return std::array<int, 2>{static_cast<int>(not_finite_ % width_), static_cast<int>(not_finite_ / width_)};
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

std::array<int, 2> ImageMap::texel_before(float s, float t, float* dx, float* dy) const {
  if (!(std::fabs(s) < 1e6f && std::fabs(t) < 1e6f)) s = t = 0;  // uv out of any meaningful range
  const float x = s * static_cast<float>(width_) - 0.5f;
  const float y = (1.0f - t) * static_cast<float>(height_) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  *dx = x - fx, *dy = y - fy;
  return {static_cast<int>(fx), static_cast<int>(fy)};
}

void ImageMap::prefetch(float s, float t) const {
  if (cache_) return;
  float dx, dy;
  const auto [ix, iy] = texel_before(s, t, &dx, &dy);
  const int x = wrap_index(ix, width_, wrap_);
  for (const int y : {wrap_index(iy, height_, wrap_t_), wrap_index(iy + 1, height_, wrap_t_)}) {
    if (x < 0 || y < 0) continue;
    const size_t i = index_of(x, y);
    __builtin_prefetch(is_bytes_ ? static_cast<const void*>(&bytes_[i]) : &floats_[i]);
  }
}

Rgb ImageMap::cubic(int x, int y, float dx, float dy) const {
  const auto weights = [](float t) {
    const float u = 1 - t;
    constexpr float kSixth = 1.0f / 6;
    return std::array<float, 4>{u * u * u * kSixth, (3 * t * t * t - 6 * t * t + 4) * kSixth,
                                (3 * u * u * u - 6 * u * u + 4) * kSixth, t * t * t * kSixth};
  };
  const std::array<float, 4> across = weights(dx), down = weights(dy);
  Rgb sum;
  const auto add = [&](const Rgb& texel, float weight) {
    sum.r += texel.r * weight, sum.g += texel.g * weight, sum.b += texel.b * weight;
  };
  for (size_t j = 0; j < 4; j += 2) {
    for (size_t i = 0; i < 4; i += 2) {
      const auto [a, b, c, d] = square(x - 1 + static_cast<int>(i), y - 1 + static_cast<int>(j));
      add(a, across[i] * down[j]);
      add(b, across[i + 1] * down[j]);
      add(c, across[i] * down[j + 1]);
      add(d, across[i + 1] * down[j + 1]);
    }
  }
  return sum;
}

Rgb ImageMap::lookup(float s, float t) const {
  float dx, dy;
  const auto [ix, iy] = texel_before(s, t, &dx, &dy);
  const auto finish = [&](float v) {
    v *= scale_;
    return invert_ ? std::max(0.0f, 1.0f - v) : v;
  };
  if (filter_ == TexelFilter::kCubic) {
    const Rgb c = cubic(ix, iy, dx, dy);
    return {finish(c.r), finish(c.g), finish(c.b)};
  }
  const bool nearest = filter_ == TexelFilter::kNearest;
  const float wx = nearest ? std::round(dx) : dx, wy = nearest ? std::round(dy) : dy;
  const auto [a, b, c, d] = square(ix, iy);
  const auto mix = [&](float p, float q, float r, float u) {
    const float top = p + (q - p) * wx, bottom = r + (u - r) * wx;
    return finish(top + (bottom - top) * wy);
  };
  return {mix(a.r, b.r, c.r, d.r), mix(a.g, b.g, c.g, d.g), mix(a.b, b.b, c.b, d.b)};
}

}  // namespace lightmill
