// Every kind of image file means the same wherever a texture may stand: integers are sRGB, floats are linear.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>

#include "common/image/image.h"
#include "tests/support/temporary_folder.h"
#include "worker/render/light/light_image.h"
#include "worker/render/scene/textures/image_map.h"

namespace lightmill {
namespace {

using test::TemporaryFolder;

constexpr int kSide = 20;  // not a multiple of the tiles

/// What every texel of a file holds: of one to four channels.
const std::vector<float> kGrey = {0.6f}, kGreyAlpha = {0.6f, 0.4f}, kRgb = {0.8f, 0.4f, 0.2f},
                         kRgba = {0.8f, 0.4f, 0.2f, 0.4f};

struct Kind {
  std::string name;  // of the file
  std::vector<float> texel;
  bool linear = false;
  float slack = 0.01f;  // of 8 bits
};

void write(
    const std::string& path, const std::vector<float>& texel, OIIO::TypeDesc type,
    const std::function<void(OIIO::ImageSpec*)>& change = [](OIIO::ImageSpec*) {}) {
  OIIO::ImageSpec spec(kSide, kSide, static_cast<int>(texel.size()), type);
  if (texel.size() % 2 == 0) spec.alpha_channel = static_cast<int>(texel.size()) - 1;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  change(&spec);
  std::vector<float> all;
  for (int i = 0; i < kSide * kSide; ++i) all.insert(all.end(), texel.begin(), texel.end());
  const auto out = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(out && out->open(path, spec) && out->write_image(OIIO::TypeDesc::FLOAT, all.data()) &&
              out->close())
      << path << ": " << (out ? out->geterror() : OIIO::geterror());
}

std::string big_endian(size_t x) {
  return {static_cast<char>(x >> 24), static_cast<char>(x >> 16), static_cast<char>(x >> 8),
          static_cast<char>(x)};
}

/// A PNG whose rows are all `row`: of palettes and of few bits, which OpenImageIO does not write.
void write_png(const std::string& path, int depth, int colour_type, const std::string& row,
               const std::string& palette) {
  const auto chunk = [](const std::string& type, const std::string& data) {
    const std::string both = type + data;
    const auto crc =
        crc32(0, reinterpret_cast<const unsigned char*>(both.data()), static_cast<uInt>(both.size()));
    return big_endian(data.size()) + both + big_endian(crc);
  };
  std::string rows;
  for (int y = 0; y < kSide; ++y) rows += '\0' + row;
  uLongf size = compressBound(rows.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
           rows.size());
  packed.resize(size);
  const std::string header =
      big_endian(kSide) + big_endian(kSide) + char(depth) + char(colour_type) + std::string(3, '\0');
  std::ofstream(path, std::ios::binary)
      << "\x89PNG\r\n\x1a\n"
      << chunk("IHDR", header) << (palette.empty() ? "" : chunk("PLTE", palette)) << chunk("IDAT", packed)
      << chunk("IEND", "");
}

/// One pixel and runs of it.
void write_qoi(const std::string& path, bool linear) {
  std::string file = "qoif" + big_endian(kSide) + big_endian(kSide) + char(4) + char(linear);
  file += "\xff\xcc\x66\x33\x66";  // kRgba
  for (int left = kSide * kSide - 1; left > 0; left -= 62)
    file += static_cast<char>(0xc0 | (std::min(left, 62) - 1));
  std::ofstream(path, std::ios::binary) << file << std::string(7, '\0') << '\1';
}

class ImageKinds : public ::testing::Test {
 protected:
  /// Every kind, written.
  std::vector<Kind> kinds() {
    using OIIO::TypeDesc;
    std::vector<Kind> all;
    const auto add = [&](
                         const std::string& name, const std::vector<float>& texel, TypeDesc type,
                         const std::function<void(OIIO::ImageSpec*)>& change = [](OIIO::ImageSpec*) {}) {
      const bool floats = type == TypeDesc::HALF || type == TypeDesc::FLOAT;
      write(folder_.file(name), texel, type, change);
      all.push_back({name, texel, floats, floats || type == TypeDesc::UINT16 ? 1e-3f : 0.01f});
    };
    const auto tiled = [](OIIO::ImageSpec* s) { s->tile_width = s->tile_height = 16; };
    for (const auto& texel : {kGrey, kGreyAlpha, kRgb, kRgba}) {
      const std::string n = std::to_string(texel.size());
      add("b" + n + ".png", texel, TypeDesc::UINT8);
      add("s" + n + ".png", texel, TypeDesc::UINT16);
      add("b" + n + ".tif", texel, TypeDesc::UINT8);
      add("s" + n + ".tif", texel, TypeDesc::UINT16);
      add("f" + n + ".tif", texel, TypeDesc::FLOAT);
      add("tiled" + n + ".tif", texel, TypeDesc::UINT16, tiled);
    }
    for (const auto& texel : {kGrey, kRgb}) {
      const std::string n = std::to_string(texel.size());
      add("h" + n + ".exr", texel, TypeDesc::HALF);
      add("f" + n + ".exr", texel, TypeDesc::FLOAT);
      add("tiled" + n + ".exr", texel, TypeDesc::HALF, tiled);
      add("j" + n + ".jpg", texel, TypeDesc::UINT8);
    }
    add("f3.hdr", kRgb, TypeDesc::FLOAT);
    all.back().slack = 0.01f;  // 8 bits beside an exponent
    add("b3.tga", kRgb, TypeDesc::UINT8);
    add("b3.bmp", kRgb, TypeDesc::UINT8);
    add("cmyk.tif", kRgb, TypeDesc::UINT8,
        [](OIIO::ImageSpec* s) { s->attribute("tiff:ColorSpace", "CMYK"); });
    for (const int bits : {1, 2, 4}) {
      const std::vector<float> white = {1};
      add("bits" + std::to_string(bits) + ".tif", white, TypeDesc::UINT8,
          [&](OIIO::ImageSpec* s) { s->attribute("oiio:BitsPerSample", bits); });
      const std::string name = "bits" + std::to_string(bits) + ".png";
      write_png(folder_.file(name), bits, 0, std::string((kSide * static_cast<size_t>(bits) + 7) / 8, '\xff'),
                "");
      all.push_back({name, white});
    }
    write_png(folder_.file("palette.png"), 8, 3, std::string(kSide, '\1'),
              std::string("\0\0\0\xcc\x66\x33", 6));
    all.push_back({"palette.png", kRgb});
    write_png(folder_.file("palette2.png"), 2, 3, std::string(kSide / 4, '\x55'),
              std::string("\0\0\0\xcc\x66\x33", 6));
    all.push_back({"palette2.png", kRgb});
    write_qoi(folder_.file("a.qoi"), false);
    all.push_back({"a.qoi", kRgba});
    write_qoi(folder_.file("linear.qoi"), true);
    all.push_back({"linear.qoi", kRgba, true});
    return all;
  }
  /// As a texture: one that is kept, and one of a cache.
  void expect_texel(const Kind& kind, ImageChannel channel, ColorEncoding encoding, const Rgb& stored,
                    bool linear) {
    ImageTexture t;
    t.path = folder_.file(kind.name);
    t.channel = channel;
    t.encoding = encoding;
    const auto decoded = [&](float x) { return linear ? x : srgb_to_linear(x); };
    const auto look = [&](const ImageMap& map, const char* how) {
      const Rgb c = map.lookup(0.37f, 0.61f);
      EXPECT_NEAR(c.r, decoded(stored.r), kind.slack) << kind.name << how;
      EXPECT_NEAR(c.g, decoded(stored.g), kind.slack) << kind.name << how;
      EXPECT_NEAR(c.b, decoded(stored.b), kind.slack) << kind.name << how;
    };
    look(ImageMap(t), "");
    if (kind.name.ends_with(".qoi")) return;  // always kept
    TextureCache cache(0);
    look(ImageMap(t, &cache), " cached");
  }
  static Rgb colour_of(const Kind& kind) {
    const std::vector<float>& t = kind.texel;
    return t.size() < 3 ? Rgb{t[0], t[0], t[0]} : Rgb{t[0], t[1], t[2]};
  }
  TemporaryFolder folder_;
};

TEST_F(ImageKinds, AsColoursOfTextures) {
  for (const Kind& kind : kinds()) {
    expect_texel(kind, ImageChannel::kRgb, ColorEncoding::kAuto, colour_of(kind), kind.linear);
  }
}

TEST_F(ImageKinds, AsNumbersAndAlpha) {
  for (const Kind& kind : kinds()) {
    const std::vector<float>& t = kind.texel;
    const float red = t[0], alpha = t.size() % 2 == 0 ? t.back() : 1;
    expect_texel(kind, ImageChannel::kRed, ColorEncoding::kLinear, {red, red, red}, true);
    expect_texel(kind, ImageChannel::kAlpha, ColorEncoding::kLinear, {alpha, alpha, alpha}, true);
  }
}

TEST_F(ImageKinds, AnEncodingIsForIntegersOnly) {
  for (const Kind& kind : kinds()) {
    if (kind.name == "linear.qoi") continue;
    expect_texel(kind, ImageChannel::kRgb, ColorEncoding::kSrgb, colour_of(kind), kind.linear);
    expect_texel(kind, ImageChannel::kRgb, ColorEncoding::kLinear, colour_of(kind), true);
  }
}

TEST_F(ImageKinds, AsLights) {
  for (const Kind& kind : kinds()) {
    const LightImage image = read_light_image(folder_.file(kind.name), "environment image");
    const Rgb c = colour_of(kind);
    for (size_t i = 0; i < 3; ++i) {
      const float stored = (&c.r)[i];
      EXPECT_NEAR(image.rgb[i], kind.linear ? stored : srgb_to_linear(stored), kind.slack) << kind.name;
    }
  }
}

}  // namespace
}  // namespace lightmill
