// Samplers against the formulas of the glTF 2.0 specification, appendix C.
#include "common/scene/gltf/animation/keyframes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace lightmill {
namespace {

using enum Keyframes::Interpolation;

Keyframes scalar(Keyframes::Interpolation how, std::vector<double> times, std::vector<float> values) {
  return {how, false, 1, std::move(times), std::move(values)};
}
double value(const Keyframes& k, double time) {
  double out = -99;
  k.at(time, &out);
  return out;
}
std::array<double, 4> turned(const Keyframes& k, double time) {
  std::array<double, 4> out{};
  k.at(time, out.data());
  return out;
}
/// A rotation about z.
std::array<float, 4> about_z(double degrees) {
  const double half = degrees * M_PI / 360;
  return {0, 0, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))};
}
double degrees_about_z(const std::array<double, 4>& q) { return 2 * std::atan2(q[2], q[3]) * 180 / M_PI; }

Keyframes turns(const std::vector<double>& degrees, double sign_of_last = 1) {
  Keyframes k{kLinear, true, 4, {}, {}};
  for (const double d : degrees) {
    k.times.push_back(static_cast<double>(k.times.size()));
    for (const float x : about_z(d)) k.values.push_back(x);
  }
  for (size_t i = k.values.size() - 4; i < k.values.size(); ++i)
    k.values[i] *= static_cast<float>(sign_of_last);
  return k;
}

TEST(Keyframes, StepsAndLines) {
  const std::vector<double> times = {1, 2, 4};
  const std::vector<float> values = {10, 20, -20};
  const Keyframes step = scalar(kStep, times, values), line = scalar(kLinear, times, values);
  for (const Keyframes& k : {step, line}) {
    EXPECT_EQ(value(k, -5), 10) << "before the first key";
    EXPECT_EQ(value(k, 1), 10);
    EXPECT_EQ(value(k, 2), 20);
    EXPECT_EQ(value(k, 4), -20);
    EXPECT_EQ(value(k, 1e9), -20) << "after the last";
  }
  EXPECT_EQ(value(step, 1.999), 10);
  EXPECT_EQ(value(step, 3.999), 20);
  EXPECT_DOUBLE_EQ(value(line, 1.25), 12.5);
  EXPECT_DOUBLE_EQ(value(line, 3), 0);
}

TEST(Keyframes, OneKeyAndKeysAtOneTime) {
  EXPECT_EQ(value(scalar(kLinear, {3}, {7}), 0), 7);
  EXPECT_EQ(value(scalar(kLinear, {3}, {7}), 9), 7);
  const Keyframes jump = scalar(kLinear, {0, 1, 1, 2}, {0, 1, 5, 6});
  EXPECT_DOUBLE_EQ(value(jump, 0.5), 0.5);
  EXPECT_EQ(value(jump, 1), 5) << "of several keys at one time the last counts";
  EXPECT_DOUBLE_EQ(value(jump, 1.5), 5.5);
  EXPECT_EQ(value(scalar(kLinear, {0, 0}, {1, 2}), 0), 2) << "an animation of no length";
}

// v(t) = (2 t^3 - 3 t^2 + 1) v_k + t_d (t^3 - 2 t^2 + t) b_k + (-2 t^3 + 3 t^2) v_k+1 + t_d (t^3 - t^2) a_k+1
TEST(Keyframes, CubicSplinesFollowTheFormula) {
  // In-tangent, value, out-tangent.
  const Keyframes k = scalar(kCubicSpline, {1, 3, 3.5}, {99, 2, -4, 6, 5, 0.5f, -1, 7, 99});
  const auto formula = [](double t, double span, double v0, double b0, double v1, double a1) {
    const double t2 = t * t, t3 = t * t * t;
    return (2 * t3 - 3 * t2 + 1) * v0 + span * (t3 - 2 * t2 + t) * b0 + (-2 * t3 + 3 * t2) * v1 +
           span * (t3 - t2) * a1;
  };
  for (const double t : {0.0, 0.1, 0.37, 0.5, 0.9}) {
    EXPECT_NEAR(value(k, 1 + 2 * t), formula(t, 2, 2, -4, 5, 6), 1e-12) << t;
    EXPECT_NEAR(value(k, 3 + 0.5 * t), formula(t, 0.5, 5, 0.5, 7, -1), 1e-12) << t;
  }
  EXPECT_EQ(value(k, 0), 2);
  EXPECT_EQ(value(k, 9), 7);
  // It leaves and arrives as steeply as its tangents say.
  constexpr double kStep = 1e-6;
  EXPECT_NEAR((value(k, 1 + kStep) - value(k, 1)) / kStep, -4, 1e-4);
  EXPECT_NEAR((value(k, 3) - value(k, 3 - kStep)) / kStep, 6, 1e-4);
}

TEST(Keyframes, CubicRotationsKeepTheirLength) {
  Keyframes k{kCubicSpline, true, 4, {0, 1}, {}};
  for (const double degrees : {0.0, 90.0}) {
    k.values.insert(k.values.end(), 4, 0.0f);
    for (const float x : about_z(degrees)) k.values.push_back(x);
    k.values.insert(k.values.end(), 4, 0.0f);
  }
  for (const double t : {0.0, 0.2, 0.5, 0.8, 1.0}) {
    const auto q = turned(k, t);
    EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-12);
  }
  EXPECT_NEAR(degrees_about_z(turned(k, 0.5)), 45, 1e-5);
}

TEST(Keyframes, RotationsTurnEvenlyTheShorterWay) {
  const Keyframes k = turns({10, 100, 350});
  for (const double t : {0.0, 0.1, 0.5, 0.75, 1.0})
    EXPECT_NEAR(degrees_about_z(turned(k, t)), 10 + 90 * t, 1e-4);
  // From 100 to 350 degrees it is 110 backwards.
  EXPECT_NEAR(std::remainder(degrees_about_z(turned(k, 1.5)) - 45, 360), 0, 1e-4);
  // A quaternion and its negative are one rotation.
  const Keyframes other = turns({10, 100}, -1);
  EXPECT_NEAR(std::remainder(degrees_about_z(turned(other, 0.5)) - 55, 360), 0, 1e-4);
}

TEST(Keyframes, RotationsThatHardlyDiffer) {
  const Keyframes k = turns({30, 30 + 1e-5});
  EXPECT_NEAR(degrees_about_z(turned(k, 0.5)), 30, 1e-4);
  const Keyframes same = turns({30, 30});
  EXPECT_NEAR(degrees_about_z(turned(same, 0.5)), 30, 1e-4);
}

TEST(Keyframes, QuaternionsOfOtherLengthsAreNormalised) {
  Keyframes k = turns({0, 90});
  for (size_t i = 0; i < 4; ++i) k.values[i] *= 3;
  EXPECT_NEAR(degrees_about_z(turned(k, 0.5)), 45, 1e-4);
  EXPECT_NEAR(degrees_about_z(turned(k, 0)), 0, 1e-4);
}

}  // namespace
}  // namespace lightmill
