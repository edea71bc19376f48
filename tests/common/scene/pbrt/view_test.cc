// Film, filter and the realistic camera as files give them.
#include "common/scene/spectrum/sensor.h"
#include "common/scene/spectrum/spectrum.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class View : public SceneTest {
 protected:
  LoadResult with_options(const std::string& options) {
    return load(options + " WorldBegin LightSource \"point\"");
  }
};

TEST_F(View, FiltersWithNegativeLobes) {
  const FilterDescription mitchell = clean(with_options("PixelFilter \"mitchell\" \"float B\" 0.5")).filter;
  EXPECT_EQ(mitchell.kind, FilterKind::kMitchell);
  EXPECT_EQ(mitchell.xradius, 2);
  EXPECT_EQ(mitchell.b, 0.5);
  EXPECT_NEAR(mitchell.c, 1.0 / 3, 1e-9);
  const FilterDescription sinc = clean(with_options("PixelFilter \"sinc\" \"float tau\" 2")).filter;
  EXPECT_EQ(sinc.kind, FilterKind::kSinc);
  EXPECT_EQ(sinc.yradius, 4);
  EXPECT_EQ(sinc.tau, 2);
}

TEST_F(View, SensorsAndTheirWhite) {
  const FilmDescription plain = clean(with_options("Film \"rgb\" \"string sensor\" \"cie1931\"")).film;
  EXPECT_EQ(plain.sensor, (ColorMatrix{1, 0, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_EQ(plain.most, 0);
  const FilmDescription canon = clean(with_options("Film \"rgb\" \"string sensor\" \"canon_eos_100d\""
                                                   " \"float maxcomponentvalue\" 7"))
                                    .film;
  EXPECT_EQ(canon.most, 7);
  for (size_t row = 0; row < 3; ++row)
    EXPECT_NEAR(canon.sensor[3 * row] + canon.sensor[3 * row + 1] + canon.sensor[3 * row + 2], 1, 0.03);
  EXPECT_EQ(sensor_names().size(), 18u);
}

// The white that is balanced for comes out neutral. pbrt-v4's own matrix for 5000 K, fitted to its renders.
TEST_F(View, WhiteBalance) {
  for (const double kelvin : {2500.0, 3900.0, 4500.0, 5600.0, 9000.0}) {
    const ColorMatrix m = white_balance(kelvin);
    const Rgb body = blackbody_to_rgb(kelvin);
    const double in[3] = {body.r, body.g, body.b};
    double out[3] = {};
    for (size_t i = 0; i < 9; ++i) out[i / 3] += m[i] * in[i % 3];
    // Daylight lies a bit above the black body.
    const double tolerance = kelvin < 4000 ? 1e-3 : 0.1;
    EXPECT_NEAR(out[0] / out[1], 1, tolerance) << kelvin;
    EXPECT_NEAR(out[2] / out[1], 1, tolerance) << kelvin;
  }
  const ColorMatrix theirs{.9401, -.0936, -.0183, .0042, 1.0251, -.0068, .0071, .03, 1.3313};
  const ColorMatrix ours = white_balance(5000);
  for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(ours[i], theirs[i], 0.01) << i;
}

TEST_F(View, RealisticCamera) {
  folder_.write(
      "lens.dat",
      "# radius thickness eta diameter\n50 5 1.5 30\n-50 4 1 30\n0 3 0 20\n-80 2 1.6 25\n90 3 1 25\n");
  const std::string camera = "Camera \"realistic\" \"string lensfile\" \"lens.dat\" ";
  const SceneDescription s =
      clean(with_options(camera + "\"float focusdistance\" 3 \"float aperturediameter\" 8"
                                  " \"string aperture\" \"star\" Film \"rgb\" \"float diagonal\" 24"));
  EXPECT_EQ(s.camera.kind, CameraKind::kRealistic);
  ASSERT_EQ(s.camera.lens.elements.size(), 5u);
  EXPECT_EQ(s.camera.lens.elements[3].radius, -80);
  EXPECT_EQ(s.camera.lens.film_diagonal, 24);
  EXPECT_EQ(s.camera.lens.aperture, "star");
  EXPECT_EQ(s.files.back().name, "lens.dat") << "goes with the bundle";
  EXPECT_TRUE(mentions(with_options(camera + "\"float aperturediameter\" 30"), "larger than the stop"));
  for (const char* bad : {"1 2 3", "50 5 1.5 word", "50 -5 1.5 30", "50 5 99 30", "0 3 0 20", ""}) {
    folder_.write("lens.dat", bad);
    EXPECT_TRUE(has_error(with_options(camera), "\"lensfile\"")) << bad;
  }
}

}  // namespace
}  // namespace lightmill
