// Textures within a bound of memory: the same bits as without one, and what can't be read is an error.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/support/render.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene.h"
#include "worker/render/renderer.h"
#include "worker/render/scene/textures/texture.h"

namespace lightmill::test {
namespace {

constexpr int kWidth = 1100, kHeight = 1000;  // no multiple of the side of a tile

/// Every texel another; `bad` texels of each kind that is not finite, and negative ones, if the format has
/// them.
Image pattern(int seed, bool bad = false) {
  Image image(kWidth, kHeight);
  for (size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<float>((i * 7919 + static_cast<size_t>(seed) * 104729) % 1009) / 1009.0f;
  if (bad) {
    image.data[3 * (kWidth * 70 + 80) + 1] = INFINITY;
    image.data[3 * (kWidth * 70 + 3)] = NAN;  // the first, in a tile after that of the other
    image.data[3 * (kWidth * 900 + 1000)] = -3;
  }
  return image;
}

class TextureMemory : public testing::Test {
 protected:
  ImageTexture write(const std::string& name, const Image& image) {
    ImageTexture t;
    t.path = folder_.file(name);
    write_image(image, t.path);
    return t;
  }
  static TextureDescription described(const ImageTexture& image) {
    TextureDescription d;
    d.kind = image;
    return d;
  }
  /// 8-bit, half and float files under several wraps, encodings and channels: 30 MB of texels.
  std::vector<TextureDescription> some_of_everything() {
    const ImageTexture png = write("a.png", pattern(1)), exr = write("b.exr", pattern(2, true));
    std::vector<TextureDescription> all{described(png), described(exr)};
    ImageTexture t = png;
    t.wrap = Wrap::kMirror;
    t.wrap_t = Wrap::kBlack;
    t.channel = ImageChannel::kGreen;
    all.push_back(described(t));
    t.channel = ImageChannel::kAlpha;
    all.push_back(described(t));
    t = exr;
    t.wrap = Wrap::kClamp;
    t.encoding = ColorEncoding::kSrgb;
    t.invert = true;
    all.push_back(described(t));
    t.filter = TexelFilter::kNearest;
    t.encoding = ColorEncoding::kGamma;
    t.gamma = 2.2f;
    t.channel = ImageChannel::kBlue;
    all.push_back(described(t));
    return all;
  }
  TemporaryFolder folder_;
};

/// Look-ups around a few places, for every one that is not in the cache takes milliseconds.
void expect_equal(const TextureTable& a, const TextureTable& b, uint64_t seed) {
  Random random(seed);
  for (int place = 0; place < 12; ++place) {
    const float u = random.uniform() * 3 - 1, v = random.uniform() * 3 - 1;
    for (int id = 0; id < static_cast<int>(a.size()); ++id) {
      for (int i = 0; i < 200; ++i) {
        const TexturePoint at{u + random.uniform() * 0.02f, v + random.uniform() * 0.02f};
        const Rgb x = a.evaluate(id, at), y = b.evaluate(id, at);
        ASSERT_TRUE(x == y) << id << " at " << at.u << " " << at.v << ": " << x.r << " " << y.r;
      }
    }
  }
}

TEST_F(TextureMemory, LookUpsHaveTheSameBitsUnderEveryBound) {
  const std::vector<TextureDescription> all = some_of_everything();
  const TextureTable free(all);
  EXPECT_EQ(free.cached_images(), 0u);
  size_t least = all.size();
  for (const uint64_t bound : {uint64_t{0}, uint64_t{24} << 20, free.bytes() - 1, free.bytes()}) {
    const TextureTable bounded(all, {2, bound});
    EXPECT_LE(bounded.bytes(), std::max(bound, TextureCache::kLeastBytes));
    EXPECT_LE(bounded.cached_images(), least) << "more memory, fewer in the cache";
    least = bounded.cached_images();
    std::vector<std::jthread> threads;
    for (uint64_t t = 0; t < 4; ++t) threads.emplace_back([&, t] { expect_equal(free, bounded, t); });
  }
  EXPECT_EQ(least, 0u);
}

TEST_F(TextureMemory, WhatIsSaidOfAnImageIsTheSame) {
  const std::vector<TextureDescription> all = some_of_everything();
  const TextureTable free(all), bounded(all, {1, 0});
  EXPECT_EQ(bounded.cached_images(), all.size());
  for (int i = 0; i < static_cast<int>(all.size()); ++i) {
    const ImageMap &a = *free.image(i), &b = *bounded.image(i);
    EXPECT_EQ(a.range(), b.range());
    EXPECT_EQ(a.inward_normals(), b.inward_normals());
    EXPECT_EQ(a.first_not_finite(), b.first_not_finite());
    EXPECT_TRUE(a.content().mean == b.content().mean);
    EXPECT_EQ(a.content().is_nan, b.content().is_nan);
    EXPECT_EQ(a.brightest(0.2f, 0.3f, 0.4f, 0.5f, 1e9), b.brightest(0.2f, 0.3f, 0.4f, 0.5f, 1e9));
  }
  EXPECT_EQ(*bounded.image(1)->first_not_finite(), (std::array<int, 2>{3, 70}));
  EXPECT_TRUE(bounded.image(1)->content().is_nan);
}

TEST_F(TextureMemory, AnImageThatCanNotBeReadAnyMoreIsAnError) {
  const ImageTexture t = write("a.exr", pattern(1));
  const TextureTable table({described(t)}, {1, 0});
  EXPECT_NO_THROW(table.throw_if_unreadable());
  std::ofstream(t.path, std::ios::trunc) << "gone";
  for (float v = 0; v < 1; v += 0.05f) {
    for (float u = 0; u < 1; u += 0.05f) table.evaluate(0, {u, v});
  }
  try {
    table.throw_if_unreadable();
    FAIL() << "not noticed";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find(t.path), std::string::npos) << e.what();
  }
}

TEST_F(TextureMemory, ADamagedImageIsRefusedAtOnce) {
  ImageTexture t = write("a.png", pattern(1));
  std::filesystem::resize_file(t.path, std::filesystem::file_size(t.path) / 2);
  EXPECT_THROW(TextureTable({described(t)}, {1, 0}), Error);
}

TEST_F(TextureMemory, ImagesInsideAFileMustFit) {
  ImageTexture t = write("a.png", pattern(1));
  std::ifstream in(t.path, std::ios::binary);
  t.contents = std::make_shared<const std::string>(std::istreambuf_iterator<char>(in),
                                                   std::istreambuf_iterator<char>());
  EXPECT_EQ(TextureTable({described(t)}, {1, uint64_t{64} << 20}).cached_images(), 0u);
  try {
    TextureTable({described(t)}, {1, 1 << 20});
    FAIL() << "it does not fit";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("raise --texture-memory"), std::string::npos) << e.what();
  }
}

TEST_F(TextureMemory, ARenderHasTheSameBitsUnderEveryBound) {
  TestScene s = cornell_room();
  for (int i = 0; i < 2; ++i) {
    s.scene.textures.push_back(described(write("wall" + std::to_string(i) + ".exr", pattern(i))));
    for (size_t m = static_cast<size_t>(i); m < s.scene.materials.size(); m += 2) {
      if (auto* diffuse = std::get_if<DiffuseMaterial>(&s.scene.materials[m].kind))
        diffuse->reflectance.texture = i;
    }
  }
  s.film(8, 8);
  const RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 1, 4);
  const auto render = [&](uint64_t bound) {
    const Renderer r(s.scene, settings, {1, bound});
    const CellRect cells = settings.grid.cells();
    PartialBuilder builder(settings.grid, {cells, 0, 1}, r.quantum_exponent(), r.has_camera_layer(),
                           r.has_splat_layer());
    const auto workspace = r.make_workspace();
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x) r.render_packet({x, y, 0, 1}, *workspace, builder);
    }
    return partial_digest(builder.take());
  };
  const std::string free = render(kUnboundedTextures);
  EXPECT_EQ(render(0), free);
  EXPECT_EQ(render(uint64_t{30} << 20), free);
}

}  // namespace
}  // namespace lightmill::test
