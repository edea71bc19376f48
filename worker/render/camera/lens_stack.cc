#include "worker/render/camera/lens_stack.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/base/error.h"
#include "worker/render/light/light_image.h"

namespace lightmill {
namespace {

constexpr int kStopSide = 256;
constexpr double kMetre = 1e-3;  // of a mm

double index_behind(const std::vector<LensElement>& e, size_t i) { return e[i].eta != 0 ? e[i].eta : 1; }
double index_before(const std::vector<LensElement>& e, size_t i) {
  return i > 0 ? index_behind(e, i - 1) : 1;
}

/// Ray transfer matrix over (height, index times slope), front vertex to rear vertex.
struct Paraxial {
  double a = 1, b = 0, c = 0, d = 1;
  double length = 0;  // between the vertices, mm

  explicit Paraxial(const std::vector<LensElement>& e) {
    for (size_t i = 0; i < e.size(); ++i) {
      const double n = index_behind(e, i);
      if (e[i].radius != 0) {
        const double power = (n - index_before(e, i)) / e[i].radius;
        c -= power * a;
        d -= power * b;
      }
      if (i + 1 == e.size()) break;
      a += e[i].thickness / n * c;
      b += e[i].thickness / n * d;
      length += e[i].thickness;
    }
  }
};

/// Distance from the rear vertex to the film at which what is `focus` mm from the film is sharp.
double film_distance(const LensSystem& system) {
  const Paraxial p(system.elements);
  const double focus = system.focus_distance / kMetre;
  if (p.c == 0) throw Error(ErrorKind::kBadScene, "the camera's lenses have no power: they can't focus");
  const double f = -1 / p.c;
  const double front = (p.d - 1) / p.c, rear = (1 - p.a) / p.c;  // principal planes from their vertices
  // Image and object distance have the sum s, and the product f s.
  const double s = focus - p.length + front - rear;
  if (!(s * (s - 4 * f) > 0) || !std::isfinite(s)) {
    throw Error(ErrorKind::kBadScene, "the camera's lenses can't focus at " +
                                          std::to_string(system.focus_distance) +
                                          " from the film; raise \"focusdistance\"");
  }
  return (s - std::sqrt(s * (s - 4 * f))) / 2 + rear;
}

using Corner = std::array<double, 2>;

/// 1 inside of a polygon (by winding number), else 0.
std::vector<float> polygon(const std::vector<Corner>& corners) {
  std::vector<float> image;
  for (int y = 0; y < kStopSide; ++y) {
    for (int x = 0; x < kStopSide; ++x) {
      const double px = -1 + 2 * (x + 0.5) / kStopSide, py = -1 + 2 * (y + 0.5) / kStopSide;
      int winding = 0;
      for (size_t i = 0; i < corners.size(); ++i) {
        const Corner &p = corners[i], &q = corners[(i + 1) % corners.size()];
        const double side = (q[0] - p[0]) * (py - p[1]) - (px - p[0]) * (q[1] - p[1]);
        if (p[1] <= py && q[1] > py && side > 0) ++winding;
        if (p[1] > py && q[1] <= py && side < 0) --winding;
      }
      image.push_back(winding != 0 ? 1.0f : 0.0f);
    }
  }
  return image;
}

/// The stop by name, from y = -1 up; of mean pi / 4, as a disk has.
std::vector<float> stop_image(const std::string& name, int* side) {
  *side = kStopSide;
  std::vector<float> image;
  if (name == "gaussian") {
    for (int y = 0; y < kStopSide; ++y) {
      for (int x = 0; x < kStopSide; ++x) {
        const double px = -1 + 2 * (x + 0.5) / kStopSide, py = -1 + 2 * (y + 0.5) / kStopSide;
        image.push_back(static_cast<float>(std::max(0.0, std::exp(-px * px - py * py) - std::exp(-1.0))));
      }
    }
  } else if (name == "square") {
    image = polygon({{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}});
  } else if (name == "pentagon" || name == "star") {
    std::vector<Corner> corners;
    const bool star = name == "star";
    for (int i = 0; i < (star ? 10 : 5); ++i) {
      // A pentagon stands on a side, its rows from the top of the picture; a star has its first inner corner
      // at +x.
      const double angle = star ? M_PI * i / 5 : -M_PI / 2 + 2 * M_PI * i / 5;
      const double r = !star ? 0.8 : i % 2 ? 1 : std::cos(M_PI * 0.4) / std::cos(M_PI * 0.2);
      corners.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    image = polygon(corners);
  } else {
    LightImage file = read_light_image(name, "aperture image", 4096);
    if (file.width != file.height)
      throw Error(ErrorKind::kBadScene, "the aperture image " + name + " must be square");
    file.make_grey();
    *side = file.width;
    for (int y = file.height - 1; y >= 0; --y) {
      for (int x = 0; x < file.width; ++x)
        image.push_back(file.rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(file.width) +
                                      static_cast<size_t>(x))]);
    }
  }
  double sum = 0;
  for (const float v : image) sum += double{v};
  if (!(sum > 0)) throw Error(ErrorKind::kBadScene, "the camera's aperture lets nothing through");
  const double scale = M_PI / 4 * static_cast<double>(image.size()) / sum;
  for (float& v : image) v = static_cast<float>(double{v} * scale);
  return image;
}

}  // namespace

float LensStack::stop_at(float x, float y) const {
  const float fx = (x + 1) * 0.5f * static_cast<float>(side) - 0.5f,
              fy = (y + 1) * 0.5f * static_cast<float>(side) - 0.5f;
  // Written so that NaN fails.
  if (!(fx > -1 && fy > -1 && fx < static_cast<float>(side) && fy < static_cast<float>(side))) return 0;
  const int ix = static_cast<int>(std::floor(fx)), iy = static_cast<int>(std::floor(fy));
  const float tx = fx - static_cast<float>(ix), ty = fy - static_cast<float>(iy);
  const auto texel = [&](int i, int j) {
    if (i < 0 || j < 0 || i >= side || j >= side) return 0.0f;
    return stop[static_cast<size_t>(j) * static_cast<size_t>(side) + static_cast<size_t>(i)];
  };
  return (texel(ix, iy) * (1 - tx) + texel(ix + 1, iy) * tx) * (1 - ty) +
         (texel(ix, iy + 1) * (1 - tx) + texel(ix + 1, iy + 1) * tx) * ty;
}

LensStack build_lenses(const LensSystem& system) {
  LensStack stack;
  const std::vector<LensElement>& e = system.elements;
  double z = film_distance(system);
  for (size_t i = e.size(); i-- > 0;) {
    if (i + 1 < e.size()) z += e[i].thickness;
    LensInterface at;
    double rim = e[i].diameter / 2;
    if (e[i].radius == 0) rim = std::min(rim, system.aperture_diameter / 2);
    at.z = static_cast<float>(z * kMetre);
    at.radius = static_cast<float>(e[i].radius * kMetre);
    at.rim2 = static_cast<float>(rim * kMetre * rim * kMetre);
    at.inv_aperture = static_cast<float>(1 / (rim * kMetre));
    at.eta_ratio = static_cast<float>(index_before(e, i) / index_behind(e, i));
    stack.interfaces.push_back(at);
  }
  if (!system.aperture.empty()) stack.stop = stop_image(system.aperture, &stack.side);
  return stack;
}

std::vector<PupilBounds> exit_pupils(const LensStack& lenses, double half_diagonal) {
  constexpr int kGrid = 96, kFilmPoints = 4;
  const LensInterface& rear = lenses.interfaces.front();
  const float reach = 1.5f * std::sqrt(rear.rim2), step = 2 * reach / kGrid;
  std::vector<PupilBounds> pupils;
  for (int k = 0; k < kPupils; ++k) {
    PupilBounds b{reach, -reach, reach, -reach};
    for (int f = 0; f < kFilmPoints; ++f) {
      const auto x =
          static_cast<float>((k + static_cast<double>(f) / (kFilmPoints - 1)) / kPupils * half_diagonal);
      for (int i = 0; i < kGrid; ++i) {
        for (int j = 0; j < kGrid; ++j) {
          const float px = -reach + (static_cast<float>(i) + 0.5f) * step,
                      py = -reach + (static_cast<float>(j) + 0.5f) * step;
          if (px >= b.x0 && px <= b.x1 && py >= b.y0 && py <= b.y1) continue;
          Vec3<float> o{x, 0, 0}, d{px - x, py, rear.z};
          if (!(trace_lenses<float>(lenses, &o, &d, true) > 0)) continue;
          b = {std::min(b.x0, px), std::max(b.x1, px), std::min(b.y0, py), std::max(b.y1, py)};
        }
      }
    }
    if (b.x1 < b.x0) {
      pupils.push_back({});
      continue;
    }
    pupils.push_back({b.x0 - step, b.x1 + step, b.y0 - step, b.y1 + step});
  }
  return pupils;
}

}  // namespace lightmill
