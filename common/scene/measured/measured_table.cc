#include "common/scene/measured/measured_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/measured/tensor_file.h"
#include "common/scene/problem_list.h"
#include "common/scene/scene_files.h"
#include "common/scene/spectrum/spectrum.h"

namespace lightmill {
namespace {

constexpr size_t kMaxNodes = 4096;  // of an axis
constexpr float kMostValue = 1e9f;

class Reader {
 public:
  explicit Reader(std::string_view data) : fields_(parse_tensor_file(data)) {}

  const TensorField* find(const std::string& name) const {
    for (const TensorField& f : fields_) {
      if (f.name == name) return &f;
    }
    return nullptr;
  }
  /// A field of floats with `dimensions` axes, each of which has at most kMaxNodes.
  const TensorField& field(const std::string& name, size_t dimensions) const {
    const TensorField* f = find(name);
    if (f == nullptr) fail_scene("has no field " + in_quotes(name));
    if (f->type != kTensorFloat32 || f->shape.size() != dimensions) {
      fail_scene("has a field " + in_quotes(name) + " that is not of 32-bit floats in " +
                 std::to_string(dimensions) + " dimensions");
    }
    for (const size_t size : f->shape) {
      if (size > kMaxNodes) fail_scene("has more than 4096 nodes along an axis of " + in_quotes(name));
    }
    return *f;
  }
  /// Increasing numbers from `low` to `high`.
  template <class T>
  std::vector<T> axis(const std::string& name, float low, float high) const {
    const TensorField& f = field(name, 1);
    std::vector<T> nodes;
    for (size_t i = 0; i < f.count(); ++i) {
      const float x = f.number(i);
      if (!(x >= low && x <= high) || (i > 0 && x <= f.number(i - 1)))
        fail_scene("has a field " + in_quotes(name) + " whose values don't increase within their range");
      nodes.push_back(x);
    }
    return nodes;
  }
  /// Values over the two last axes of `dimensions`, the ones before having the sizes `slices`.
  MeasuredGrid grid(const std::string& name, const std::vector<size_t>& slices) const {
    const TensorField& f = shaped(name, slices);
    MeasuredGrid g = sized(f);
    g.values.resize(f.count());
    for (size_t i = 0; i < g.values.size(); ++i) g.values[i] = checked(f, i);
    return g;
  }
  /// The spectra at every node, reduced to RGB; of a file that has none, its rgb.
  MeasuredGrid colours(size_t phis, size_t thetas) const {
    const std::string name = find("spectra") == nullptr && find("rgb") != nullptr ? "rgb" : "spectra";
    std::vector<std::array<double, 3>> weights = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (name == "spectra") weights = factor_weights(axis<double>("wavelengths", 1, 1e6f));
    const TensorField& f = shaped(name, {phis, thetas, weights.size()});
    MeasuredGrid g = sized(f);
    g.channels = 3;
    const size_t nodes = f.shape[3] * f.shape[4];
    g.values.resize(phis * thetas * nodes * 3);
    std::vector<double> sums;
    for (size_t slice = 0; slice < phis * thetas; ++slice) {
      sums.assign(nodes * 3, 0);
      for (size_t w = 0; w < weights.size(); ++w) {
        for (size_t i = 0; i < nodes; ++i) {
          const double x = double{checked(f, (slice * weights.size() + w) * nodes + i)};
          for (size_t c = 0; c < 3; ++c) sums[3 * i + c] += weights[w][c] * x;
        }
      }
      for (size_t i = 0; i < sums.size(); ++i)
        g.values[slice * sums.size() + i] = static_cast<float>(std::max(sums[i], 0.0));
    }
    return g;
  }

 private:
  /// A field of two axes behind those of the given sizes.
  const TensorField& shaped(const std::string& name, const std::vector<size_t>& slices) const {
    const TensorField& f = field(name, slices.size() + 2);
    bool fits = f.shape[slices.size()] >= 2 && f.shape[slices.size() + 1] >= 2;
    for (size_t i = 0; i < slices.size(); ++i) fits = fits && f.shape[i] == slices[i];
    if (!fits) fail_scene("has a field " + in_quotes(name) + " whose sizes don't fit the other fields");
    return f;
  }
  static MeasuredGrid sized(const TensorField& f) {
    MeasuredGrid g;
    g.width = static_cast<int>(f.shape.back());
    g.height = static_cast<int>(f.shape[f.shape.size() - 2]);
    return g;
  }
  /// Noise may have left a little below 0.
  static float checked(const TensorField& f, size_t i) {
    const float x = f.number(i);
    if (!(std::fabs(x) <= kMostValue))
      fail_scene("has a value that is beyond 1e9 or no number in the field " + in_quotes(f.name));
    return std::max(x, 0.0f);
  }

  std::vector<TensorField> fields_;
};

}  // namespace

MeasuredTable parse_measured(std::string_view data) {
  const Reader in(data);
  constexpr float kPi = 3.1415927f, kSlack = 1e-3f;
  MeasuredTable m;
  m.phi = in.axis<float>("phi_i", -2 * kPi - kSlack, 2 * kPi + kSlack);
  m.theta = in.axis<float>("theta_i", 0, kPi / 2 + kSlack);
  const float around = m.phi.back() - m.phi.front();
  if (!m.isotropic() && std::fabs(around / (2 * kPi) - 1) > 0.25f)
    fail_scene("has azimuths that do not go around the circle once; files of a part of it can't be read");
  m.ndf = in.grid("ndf", {});
  m.sigma = in.grid("sigma", {});
  m.visible = in.grid("vndf", {m.phi.size(), m.theta.size()});
  m.luminance = in.grid("luminance", {m.phi.size(), m.theta.size()});
  m.rgb = in.colours(m.phi.size(), m.theta.size());
  if (m.rgb.width != m.luminance.width || m.rgb.height != m.luminance.height)
    fail_scene("has a field \"luminance\" of other sizes than its colours");
  return m;
}

MeasuredTable read_measured_file(const std::string& path) {
  return parse_measured(read_scene_file(path, kMaxMeasuredBytes));
}

}  // namespace lightmill
