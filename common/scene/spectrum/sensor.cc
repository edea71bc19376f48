#include "common/scene/spectrum/sensor.h"

#include <string>

#include "common/scene/spectrum/spectrum.h"

namespace lightmill {
namespace {

struct Sensor {
  std::string_view name;
  ColorMatrix matrix;
};
// Least squares over the 27 reflectances whose components are .1, .45 or .8; the fits are within 0.01 to 0.04
// of single colours.
constexpr Sensor kSensors[] = {
    {"cie1931", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
    {"canon_eos_100d", {1.0103, -0.0159, -0.0052, -0.002, 1.0364, -0.0452, 0.001, 0.0295, 0.9631}},
    {"canon_eos_1dx_mkii", {1.0064, -0.0144, 0.0042, -0.0003, 1.0403, -0.0511, -0.0025, 0.0406, 0.9506}},
    {"canon_eos_200d", {1.0108, -0.0269, 0.01, -0.002, 1.0486, -0.0614, 0.002, 0.0238, 0.9706}},
    {"canon_eos_200d_mkii", {1.0084, -0.0239, 0.0113, -0.0009, 1.0479, -0.061, -0.0006, 0.0283, 0.9649}},
    {"canon_eos_5d", {1.0063, -0.0071, -0.0185, 0.0043, 1.0068, -0.0152, -0.0162, 0.0812, 0.9113}},
    {"canon_eos_5d_mkii", {1.0077, -0.0159, -0.0012, 0.0015, 1.0267, -0.0363, -0.0067, 0.0528, 0.9405}},
    {"canon_eos_5d_mkiii", {1.007, -0.0078, -0.0075, -0.0001, 1.0289, -0.0372, -0.0038, 0.0484, 0.9424}},
    {"canon_eos_5d_mkiv", {1.0065, -0.0179, 0.0045, 0.0017, 1.0367, -0.0481, -0.0098, 0.0579, 0.9332}},
    {"canon_eos_5ds", {1.0086, -0.021, 0.0028, 0.0012, 1.0392, -0.0514, -0.0077, 0.0491, 0.943}},
    {"canon_eos_m", {1.011, -0.0148, -0.0085, -0.0021, 1.0367, -0.0457, 0.0016, 0.0282, 0.9653}},
    {"hasselblad_l1d_20c", {1.0033, 0.0114, -0.0302, 0.0018, 1.0339, -0.0444, -0.0116, 0.0629, 0.9293}},
    {"nikon_d810", {1.0032, 0.0261, -0.0439, 0.0028, 1.0078, -0.0149, -0.0121, 0.07, 0.923}},
    {"nikon_d850", {1.0037, 0.0184, -0.0383, 0.003, 1.0205, -0.0297, -0.0139, 0.0773, 0.9144}},
    {"sony_ilce_6400", {1.0057, 0.0181, -0.0339, -0.0034, 1.0215, -0.0259, 0.0044, 0.0301, 0.9649}},
    {"sony_ilce_7m3", {1.0049, 0.0166, -0.0323, -0.0004, 1.0157, -0.0227, 0.0012, 0.0363, 0.9578}},
    {"sony_ilce_7rm3", {1.0038, 0.0184, -0.0347, 0.0005, 1.0135, -0.0203, -0.0023, 0.0431, 0.9507}},
    {"sony_ilce_9", {1.0072, 0.0102, -0.0231, -0.0023, 1.0201, -0.028, 0.0093, 0.0184, 0.9786}},
};

constexpr ColorMatrix kXyzOfRgb = {0.4123908, 0.3575843, 0.1804808, 0.2126390, 0.7151687,
                                   0.0721923, 0.0193308, 0.1191948, 0.9505322};
constexpr ColorMatrix kBradford = {0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296};

ColorMatrix inverse(const ColorMatrix& m) {
  const auto minor = [&](int r0, int r1, int c0, int c1) {
    const auto at = [&](int r, int c) { return m[static_cast<size_t>(3 * r + c)]; };
    return at(r0, c0) * at(r1, c1) - at(r0, c1) * at(r1, c0);
  };
  const double det = m[0] * minor(1, 2, 1, 2) - m[1] * minor(1, 2, 0, 2) + m[2] * minor(1, 2, 0, 1);
  return {minor(1, 2, 1, 2) / det,  -minor(0, 2, 1, 2) / det, minor(0, 1, 1, 2) / det,
          -minor(1, 2, 0, 2) / det, minor(0, 2, 0, 2) / det,  -minor(0, 1, 0, 2) / det,
          minor(1, 2, 0, 1) / det,  -minor(0, 2, 0, 1) / det, minor(0, 1, 0, 1) / det};
}

std::array<double, 3> transformed(const ColorMatrix& m, const std::array<double, 3>& v) {
  std::array<double, 3> out{};
  for (size_t i = 0; i < 3; ++i) out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
  return out;
}

/// XYZ of luminance 1.
std::array<double, 3> daylight(double kelvin) {
  const double t = kelvin * 1.4388 / 1.4380;  // the series were made for an older constant of Planck's law
  if (t < 4000) {
    const Rgb c = blackbody_to_rgb(kelvin);
    return transformed(kXyzOfRgb, {double{c.r}, double{c.g}, double{c.b}});
  }
  const double i = 1e3 / t;
  const double x = t <= 7000 ? ((-4.6070 * i + 2.9678) * i + 0.09911) * i + 0.244063
                             : ((-2.0064 * i + 1.9018) * i + 0.24748) * i + 0.237040;
  const double y = (-3 * x + 2.870) * x - 0.275;
  return {x / y, 1, (1 - x - y) / y};
}

}  // namespace

std::optional<ColorMatrix> sensor_named(std::string_view name) {
  for (const Sensor& s : kSensors) {
    if (s.name == name) return s.matrix;
  }
  return std::nullopt;
}

std::vector<std::string_view> sensor_names() {
  std::vector<std::string_view> names;
  for (const Sensor& s : kSensors) names.push_back(s.name);
  return names;
}

ColorMatrix product(const ColorMatrix& a, const ColorMatrix& b) {
  ColorMatrix out{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) out[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    }
  }
  return out;
}

ColorMatrix white_balance(double kelvin) {
  const auto from = transformed(kBradford, daylight(kelvin)),
             to = transformed(kBradford, transformed(kXyzOfRgb, {1, 1, 1}));
  const ColorMatrix scale = {to[0] / from[0], 0, 0, 0, to[1] / from[1], 0, 0, 0, to[2] / from[2]};
  const ColorMatrix cones = product(kBradford, kXyzOfRgb);
  return product(inverse(cones), product(scale, cones));
}

}  // namespace lightmill
