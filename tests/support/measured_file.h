#pragma once
// Files of measured BRDFs, made of BRDFs that are known.
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/description.h"
#include "common/scene/measured/measured_table.h"

namespace lightmill::test {

/// Writes tensor files, field by field.
class TensorWriter {
 public:
  TensorWriter& floats(const std::string& name, const std::vector<uint64_t>& shape,
                       const std::vector<float>& values);
  /// Numbers of any type, as their bytes.
  TensorWriter& bytes(const std::string& name, uint8_t type, const std::vector<uint64_t>& shape,
                      const std::string& values);
  std::string file() const;

 private:
  struct Field {
    std::string name;
    uint8_t type;
    std::vector<uint64_t> shape;
    std::string values;
  };
  std::vector<Field> fields_;
};

/// f, 1/sr, of a viewer and a light: unit vectors above the surface.
using KnownBrdf = std::function<double(const Vec3d& viewer, const Vec3d& light)>;

/// How a BRDF is tabulated: views, nodes a side of the tables over facets and of the warped square. Facets
/// are taken to be GGX's of roughness `alpha`, whatever the BRDF.
struct TabulatedBrdf {
  KnownBrdf f;
  int azimuths = 1, zeniths = 9, facets = 64, warped = 32;
  double alpha = 1;
  /// Wavelength (nm) and factor; f times these are the file's spectra.
  std::vector<std::pair<double, double>> spectrum = {{360, 1}, {830, 1}};
};
std::string measured_file(const TabulatedBrdf& brdf);
/// What the reader makes of it, as a material.
MeasuredMaterial measured_material(const TabulatedBrdf& brdf);

/// f of GGX with F = 1 and height-correlated masking, by a roughness for each direction.
KnownBrdf ggx_brdf(double alpha_x, double alpha_y);

}  // namespace lightmill::test
