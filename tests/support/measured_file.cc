#include "tests/support/measured_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace lightmill::test {
namespace {

template <class T>
std::string raw(const T& x) {
  std::string bytes(sizeof x, '\0');
  std::memcpy(bytes.data(), &x, sizeof x);
  return bytes;
}

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vec3d direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

double lambda(const Vec3d& w, double ax, double ay) {
  return (std::sqrt(1 + (ax * ax * w.x * w.x + ay * ay * w.y * w.y) / (w.z * w.z)) - 1) / 2;
}
double density(const Vec3d& m, double ax, double ay) {
  const double e = m.x * m.x / (ax * ax) + m.y * m.y / (ay * ay) + m.z * m.z;
  return 1 / (M_PI * ax * ay * e * e);
}

/// Values at the nodes of a square grid, bilinear, as a density that can be warped to.
class Square {
 public:
  Square(int nodes, const std::function<double(double x, double y)>& value) : n_(nodes) {
    for (int y = 0; y < n_; ++y) {
      for (int x = 0; x < n_; ++x) values_.push_back(value(place(x), place(y)));
    }
  }
  double place(int i) const { return static_cast<double>(i) / (n_ - 1); }
  std::vector<float> values() const { return {values_.begin(), values_.end()}; }
  /// Where the uniform point (u, v) goes, by bisection: v among the rows, u within the row.
  std::pair<double, double> warp(double u, double v) const {
    const double total = rows_to(1);
    const double y = bisect([&](double t) { return rows_to(t); }, v * total);
    return {bisect([&](double t) { return row_to(y, t); }, u * row_to(y, 1)), y};
  }

 private:
  double at(int x, double y) const {
    const int j = std::min(static_cast<int>(y * (n_ - 1)), n_ - 2);
    const double t = y * (n_ - 1) - j;
    const auto v = [&](int row) { return values_[static_cast<size_t>(row * n_ + x)]; };
    return v(j) * (1 - t) + v(j + 1) * t;
  }
  /// Integral over [0, to] of a line between nodes; h is their distance.
  static double piece(double a, double b, double to) { return to * (a + (b - a) * to / 2); }
  template <class Value>
  double integral(const Value& value, double to) const {
    double sum = 0;
    for (int i = 0; i + 1 < n_ && place(i) < to; ++i) {
      const double part = std::min(1.0, (to - place(i)) * (n_ - 1));
      sum += piece(value(i), value(i + 1), part) / (n_ - 1);
    }
    return sum;
  }
  double row_to(double y, double x) const {
    return integral([&](int i) { return at(i, y); }, x);
  }
  double rows_to(double y) const {
    if (row_sums_.empty()) {
      for (int j = 0; j < n_; ++j) row_sums_.push_back(row_to(place(j), 1));
    }
    return integral([&](int j) { return row_sums_[static_cast<size_t>(j)]; }, y);
  }
  template <class Fn>
  static double bisect(const Fn& fn, double wanted) {
    double low = 0, high = 1;
    for (int i = 0; i < 40; ++i) (fn((low + high) / 2) <= wanted ? low : high) = (low + high) / 2;
    return (low + high) / 2;
  }

  int n_;
  std::vector<double> values_;
  mutable std::vector<double> row_sums_;
};

Vec3d facet(double x, double y) { return direction(x * x * M_PI / 2, 2 * M_PI * (y - 0.5)); }

}  // namespace

TensorWriter& TensorWriter::bytes(const std::string& name, uint8_t type, const std::vector<uint64_t>& shape,
                                  const std::string& values) {
  fields_.push_back({name, type, shape, values});
  return *this;
}

TensorWriter& TensorWriter::floats(const std::string& name, const std::vector<uint64_t>& shape,
                                   const std::vector<float>& values) {
  std::string packed(values.size() * sizeof(float), '\0');
  std::memcpy(packed.data(), values.data(), packed.size());
  return bytes(name, 10, shape, packed);
}

std::string TensorWriter::file() const {
  size_t at = 18;
  for (const Field& f : fields_) at += 13 + f.name.size() + 8 * f.shape.size();
  std::string head("tensor_file\0\1\0", 14), data;
  head += raw(static_cast<uint32_t>(fields_.size()));
  for (const Field& f : fields_) {
    head += raw(static_cast<uint16_t>(f.name.size())) + f.name + raw(static_cast<uint16_t>(f.shape.size())) +
            raw(f.type) + raw(static_cast<uint64_t>(at + data.size()));
    for (const uint64_t size : f.shape) head += raw(size);
    data += f.values;
  }
  return head + data;
}

KnownBrdf ggx_brdf(double alpha_x, double alpha_y) {
  return [=](const Vec3d& o, const Vec3d& i) {
    Vec3d m{o.x + i.x, o.y + i.y, o.z + i.z};
    const double length = std::sqrt(dot(m, m));
    m = {m.x / length, m.y / length, m.z / length};
    const double g = 1 / (1 + lambda(o, alpha_x, alpha_y) + lambda(i, alpha_x, alpha_y));
    return density(m, alpha_x, alpha_y) * g / (4 * o.z * i.z);
  };
}

std::string measured_file(const TabulatedBrdf& brdf) {
  const double a = brdf.alpha;
  const auto sigma = [&](const Vec3d& o) { return o.z * (1 + lambda(o, a, a)); };
  std::vector<float> phi, theta, wavelengths, ndf, sigmas, visible, luminance, spectra;
  for (int i = 0; i < brdf.azimuths; ++i)
    phi.push_back(brdf.azimuths == 1 ? 0 : static_cast<float>(M_PI * (2.0 * i / (brdf.azimuths - 1) - 1)));
  for (int i = 0; i < brdf.zeniths; ++i)
    theta.push_back(static_cast<float>(88.5 * M_PI / 180 * i / (brdf.zeniths - 1)));
  for (const auto& [nm, factor] : brdf.spectrum) wavelengths.push_back(static_cast<float>(nm));
  constexpr int kFlat = 128;
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < kFlat; ++x) {
      const Vec3d w = facet(static_cast<double>(x) / (kFlat - 1), 0.5);
      ndf.push_back(static_cast<float>(density(w, a, a)));
      sigmas.push_back(static_cast<float>(sigma({w.x, w.y, std::max(w.z, 1e-9)})));
    }
  }
  for (const float p : phi) {
    for (const float t : theta) {
      const Vec3d o = direction(double{t}, double{p});
      const Square seen(brdf.facets, [&](double x, double y) {
        const Vec3d m = facet(x, y);
        return density(m, a, a) * std::max(dot(o, m), 0.0) / sigma(o) * 2 * M_PI * M_PI * x *
               std::sqrt(1 - m.z * m.z);
      });
      const auto values = seen.values();
      visible.insert(visible.end(), values.begin(), values.end());
      const Square reflected(brdf.warped, [&](double u, double v) {
        const auto [x, y] = seen.warp(u, v);
        const Vec3d m = facet(x, y);
        const double c = 2 * dot(o, m);
        const Vec3d i{m.x * c - o.x, m.y * c - o.y, m.z * c - o.z};
        return i.z > 0 && c > 0 ? brdf.f(o, i) * i.z * 4 * sigma(o) / density(m, a, a) : 0.0;
      });
      const auto colours = reflected.values();
      luminance.insert(luminance.end(), colours.begin(), colours.end());
      for (const auto& [nm, factor] : brdf.spectrum) {
        for (const float c : colours) spectra.push_back(static_cast<float>(double{c} * factor));
      }
    }
  }
  const uint64_t phis = phi.size(), thetas = theta.size(), facets = static_cast<uint64_t>(brdf.facets),
                 warped = static_cast<uint64_t>(brdf.warped);
  return TensorWriter()
      .bytes("description", 1, {4}, "test")
      .floats("phi_i", {phis}, phi)
      .floats("theta_i", {thetas}, theta)
      .floats("ndf", {2, kFlat}, ndf)
      .floats("sigma", {2, kFlat}, sigmas)
      .floats("vndf", {phis, thetas, facets, facets}, visible)
      .floats("luminance", {phis, thetas, warped, warped}, luminance)
      .floats("wavelengths", {wavelengths.size()}, wavelengths)
      .floats("spectra", {phis, thetas, wavelengths.size(), warped, warped}, spectra)
      .bytes("jacobian", 1, {1}, std::string(1, '\1'))
      .file();
}

MeasuredMaterial measured_material(const TabulatedBrdf& brdf) {
  return {std::make_shared<MeasuredTable>(parse_measured(measured_file(brdf)))};
}

}  // namespace lightmill::test
