// Files of measured BRDFs: what they hold arrives, and what is no such file is refused with one line.
#include <cmath>
#include <cstring>
#include <random>

#include "common/base/error.h"
#include "common/scene/measured/measured_table.h"
#include "common/scene/measured/tensor_file.h"
#include "common/scene/spectrum/spectrum.h"
#include "tests/common/scene/scene_fixture.h"
#include "tests/support/measured_file.h"

namespace lightmill {
namespace {

using test::TensorWriter;

test::TabulatedBrdf small_brdf() {
  test::TabulatedBrdf b;
  b.f = [](const Vec3d&, const Vec3d&) { return 0.5 / M_PI; };
  b.zeniths = 3;
  b.facets = 8;
  b.warped = 6;
  return b;
}

std::string refusal(const std::string& bytes) {
  try {
    parse_measured(bytes);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(MeasuredTable, FieldsArriveWithTheirSizes) {
  const MeasuredTable m = parse_measured(measured_file(small_brdf()));
  EXPECT_TRUE(m.isotropic());
  ASSERT_EQ(m.theta.size(), 3u);
  EXPECT_FLOAT_EQ(m.theta[2], static_cast<float>(88.5 * M_PI / 180));
  EXPECT_EQ(m.ndf.width, 128);
  EXPECT_EQ(m.ndf.height, 2);
  EXPECT_FLOAT_EQ(m.ndf.values[5], static_cast<float>(1 / M_PI));  // GGX of alpha 1 is even
  EXPECT_EQ(m.visible.values.size(), 3u * 8 * 8);
  EXPECT_EQ(m.rgb.channels, 3);
  ASSERT_EQ(m.rgb.values.size(), 3u * 6 * 6 * 3);
  // A constant spectrum is grey, whatever its wavelengths.
  for (size_t i = 0; i < m.luminance.values.size(); ++i) {
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(m.rgb.values[3 * i + c], m.luminance.values[i], 1e-6f * m.luminance.values[i]);
  }
}

TEST(MeasuredTable, SpectraBecomeTheRgbOfFactors) {
  test::TabulatedBrdf b = small_brdf();
  b.spectrum = {{400, 0.2}, {520, 0.4}, {600, 0.9}, {700, 0.8}};
  const Rgb expected = factor_to_rgb({{400, 520, 600, 700}, {0.2, 0.4, 0.9, 0.8}});
  const MeasuredTable m = parse_measured(measured_file(b));
  size_t compared = 0;
  for (size_t i = 0; i < m.luminance.values.size(); ++i) {
    const float grey = m.luminance.values[i];
    if (grey == 0) continue;
    EXPECT_NEAR(m.rgb.values[3 * i] / grey, expected.r, 1e-5f);
    EXPECT_NEAR(m.rgb.values[3 * i + 1] / grey, expected.g, 1e-5f);
    EXPECT_NEAR(m.rgb.values[3 * i + 2] / grey, expected.b, 1e-5f);
    ++compared;
  }
  EXPECT_GT(compared, 50u);
}

/// Fields of a sound file of one view, of which a test changes one.
struct Fields {
  std::vector<float> phi = {0}, theta = {0.3f}, ndf = {1, 1, 1, 1}, sigma = {1, 1, 1, 1}, vndf = {1, 1, 1, 1},
                     luminance = {1, 1, 1, 1}, rgb = std::vector<float>(12, 0.5f);
  uint64_t vndf_views = 1, rgb_channels = 3, rgb_height = 2;
  std::string file() const {
    return TensorWriter()
        .floats("phi_i", {phi.size()}, phi)
        .floats("theta_i", {theta.size()}, theta)
        .floats("ndf", {2, 2}, ndf)
        .floats("sigma", {2, 2}, sigma)
        .floats("vndf", {1, vndf_views, 2, 2}, vndf)
        .floats("luminance", {1, 1, 2, 2}, luminance)
        .floats("rgb", {1, 1, rgb_channels, rgb_height, 2}, rgb)
        .file();
  }
};

TEST(MeasuredTable, RgbMayStandForSpectra) {
  Fields f;
  f.rgb = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  const MeasuredTable m = parse_measured(f.file());
  EXPECT_EQ(m.rgb.values, (std::vector<float>{0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11}));
}

TEST(MeasuredTable, WhatDoesNotFitIsRefusedByName) {
  const auto with = [](auto&& change) {
    Fields f;
    change(f);
    return refusal(f.file());
  };
  EXPECT_EQ(with([](Fields&) {}), "");
  const float nan = std::nanf("");
  EXPECT_NE(with([&](Fields& f) { f.vndf[2] = nan; }).find("no number in the field \"vndf\""),
            std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.sigma[0] = -INFINITY; }).find("\"sigma\""), std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.rgb[0] = 1e10f; }).find("\"rgb\""), std::string::npos);
  EXPECT_EQ(with([](Fields& f) { f.rgb[0] = -0.01f; }), "");  // noise
  EXPECT_NE(with([](Fields& f) { f.theta[0] = 2; }).find("\"theta_i\""), std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.theta = {0.5f, 0.4f}; }).find("don't increase"), std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.phi = {0, 1, 2}; }).find("around the circle"), std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.vndf_views = 2, f.vndf.resize(8); }).find("\"vndf\" whose sizes"),
            std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.rgb_channels = 1, f.rgb.resize(4); }).find("\"rgb\" whose sizes"),
            std::string::npos);
  EXPECT_NE(with([](Fields& f) { f.rgb_height = 3, f.rgb.resize(18); }).find("\"luminance\""),
            std::string::npos);
}

TEST(MeasuredTable, FilesOfOtherKindsAreRefused) {
  EXPECT_NE(refusal("").find("is no tensor file"), std::string::npos);
  EXPECT_NE(refusal("ply\nformat ascii 1.0\n").find("is no tensor file"), std::string::npos);
  EXPECT_NE(refusal(TensorWriter().file()).find("has no field"), std::string::npos);
  std::string later = TensorWriter().file();
  later[12] = 2;
  EXPECT_NE(refusal(later).find("of version 2.0"), std::string::npos);
  const auto one = [](uint8_t type, const std::vector<uint64_t>& shape) {
    return refusal(TensorWriter().bytes("phi_i", type, shape, "12345678").file());
  };
  EXPECT_NE(one(11, {1}).find("not of 32-bit floats"), std::string::npos);
  EXPECT_NE(one(10, {1, 2}).find("not of 32-bit floats"), std::string::npos);
  EXPECT_NE(one(77, {1}).find("unknown type"), std::string::npos);
  EXPECT_NE(one(10, {0}).find("empty field"), std::string::npos);
  EXPECT_NE(one(10, {}).find("of 0 dimensions"), std::string::npos);
  EXPECT_NE(one(10, {3}).find("is truncated"), std::string::npos);
  const uint64_t huge = uint64_t{1} << 62;
  EXPECT_NE(one(10, {huge, huge, huge}).find("is truncated"), std::string::npos);
  EXPECT_NE(refusal(TensorWriter().floats("a", {1}, {1}).floats("a", {1}, {1}).file()).find("twice"),
            std::string::npos);
}

TEST(MeasuredTable, NoPrefixAndNoFlippedByteDoesHarm) {
  const std::string whole = Fields().file();
  for (size_t n = 0; n < whole.size(); ++n) EXPECT_NE(refusal(whole.substr(0, n)), "") << n;
  std::mt19937_64 random(3);
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 1 + i % 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    const std::string why = refusal(bytes);
    EXPECT_EQ(why.find('\n'), std::string::npos);
    refused += !why.empty();
  }
  EXPECT_GT(refused, 5000);
}

class MeasuredMaterials : public SceneTest {};

TEST_F(MeasuredMaterials, OneFileIsReadOnce) {
  folder_.write("m.bsdf", measured_file(small_brdf()));
  const std::string material = "Material \"measured\" \"string filename\" \"m.bsdf\" Shape \"sphere\"\n";
  const SceneDescription scene = clean_world(material + material);
  ASSERT_GE(scene.materials.size(), 2u);
  const auto* first = std::get_if<MeasuredMaterial>(&scene.materials[scene.materials.size() - 1].kind);
  const auto* second = std::get_if<MeasuredMaterial>(&scene.materials[scene.materials.size() - 2].kind);
  ASSERT_TRUE(first && second && first->table);
  EXPECT_EQ(first->table, second->table);
  const auto listed_as = [](const SourceFile& f) { return f.name == "m.bsdf"; };
  EXPECT_EQ(std::count_if(scene.files.begin(), scene.files.end(), listed_as), 1);
}

TEST_F(MeasuredMaterials, WhatIsWrongIsSaidWithItsPlace) {
  folder_.write("broken.bsdf", measured_file(small_brdf()).substr(0, 1000));
  const auto material = [&](const std::string& parameters) {
    return load_world("Material \"measured\" " + parameters + " Shape \"sphere\"");
  };
  EXPECT_TRUE(refused_on_line_2(material(""), "must name a file of a measured BSDF"));
  EXPECT_TRUE(
      refused_on_line_2(material("\"string filename\" \"none.bsdf\""), "there is no file \"none.bsdf\""));
  EXPECT_TRUE(refused_on_line_2(material("\"string filename\" \"broken.bsdf\""),
                                "the measured BSDF \"broken.bsdf\" is truncated"));
  EXPECT_TRUE(refused_on_line_2(material("\"string filenam\" \"broken.bsdf\""), "did you mean \"filename\""));
}

}  // namespace
}  // namespace lightmill
