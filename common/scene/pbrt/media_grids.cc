// Media that vary: "uniformgrid", "rgbgrid", "cloud" and "nanovdb".
#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/volume/volume_grid.h"

namespace lightmill {
namespace {

constexpr double kMostCoefficient = 1e30;
constexpr int64_t kMostSide = 1 << 20, kMostVoxels = int64_t{1} << 31;
/// Integral over the colour matching function of luminance: what pbrt's camera makes of a spectrum that is 1
/// everywhere. pbrt scales the spectra of lights by its inverse, but not the radiance of an "rgbgrid".
constexpr double kLuminanceIntegral = 106.856895;

/// Box and voxels of the medium at hand.
struct Lattice {
  int nx = 1, ny = 1, nz = 1;
  Vec3d lo{0, 0, 0}, hi{1, 1, 1};
  size_t count() const { return static_cast<size_t>(nx) * static_cast<size_t>(ny) * static_cast<size_t>(nz); }
};

class GridReader {
 public:
  GridReader(ParameterList& params) : params_(params) {}

  /// False (reported) if there is no such grid.
  bool read_lattice(bool voxels) {
    const auto side = [&](const char* name) { return voxels ? params_.integer(name, 1, 1, kMostSide) : 1; };
    const int64_t nx = side("nx"), ny = side("ny"), nz = side("nz");
    const auto corner = [&](const char* name, double fallback) -> Vec3d {
      const std::vector<double>* p = params_.numbers(name, ParamType::kPoint3, 3);
      return p == nullptr ? Vec3d{fallback, fallback, fallback} : Vec3d{(*p)[0], (*p)[1], (*p)[2]};
    };
    const Vec3d a = corner("p0", 0), b = corner("p1", 1);
    if (nx * ny > kMostVoxels || nx * ny * nz > kMostVoxels) {
      empty("has more than 2^31 voxels");
      return false;
    }
    lattice_ = {static_cast<int>(nx),
                static_cast<int>(ny),
                static_cast<int>(nz),
                {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)},
                {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}};
    if (!(lattice_.hi.x > lattice_.lo.x && lattice_.hi.y > lattice_.lo.y && lattice_.hi.z > lattice_.lo.z)) {
      empty("has a box from \"p0\" to \"p1\" without a volume");
      return false;
    }
    return true;
  }

  /// The values of `name`, times `factor`. Null if it is not there, or (reported) not one for each voxel.
  std::shared_ptr<const VolumeField> field(const char* name, ParamType type, double factor) {
    const std::vector<double>* const given = params_.numbers(name, type);
    if (given == nullptr) return nullptr;
    const size_t channels = type == ParamType::kRgb ? 3 : 1;
    const size_t values = given->size() / channels;
    if (values != lattice_.count()) {
      params_.odd_value(name, "has " + std::to_string(values) + " values, where nx, ny and nz ask for " +
                                  std::to_string(lattice_.count()) + "; it is left out");
      return nullptr;
    }
    auto f = over_box();
    f->channels = static_cast<int>(channels);
    f->values.reserve(given->size());
    bool odd = false;
    for (const double x : *given) {
      const double v = x * factor;
      const bool good = v >= 0 && v <= kMostCoefficient;
      odd = odd || !good;
      f->values.push_back(good ? static_cast<float>(v) : v > 0 ? static_cast<float>(kMostCoefficient) : 0.0f);
    }
    if (odd) params_.odd_value(name, "must be within 0 and 1e30; values are cut to that");
    if (channels == 3) to_working_space(*params_.find(name, {ParamType::kRgb}), f.get());
    return f;
  }

  /// One value for the whole box, which pbrt lets fall off from its middle as it does between voxels.
  std::shared_ptr<const VolumeField> one_voxel() const {
    auto f = over_box();
    f->nx = f->ny = f->nz = 1;
    f->values = {1};
    return f;
  }

  const Lattice& lattice() const { return lattice_; }
  void empty(const std::string& why) {
    params_.problems().warning(params_.where(), params_.owner() + " " + why + "; it is empty space");
  }

 private:
  std::shared_ptr<VolumeField> over_box() const {
    auto f = std::make_shared<VolumeField>();
    f->nx = lattice_.nx, f->ny = lattice_.ny, f->nz = lattice_.nz;
    f->lo = lattice_.lo, f->hi = lattice_.hi;
    return f;
  }
  static void to_working_space(const Parameter& p, VolumeField* f) {
    if (p.color_space == ColorSpace::kSrgb) return;
    for (size_t i = 0; i + 2 < f->values.size(); i += 3) {
      const auto rgb = to_rec709(p.color_space, {f->values[i], f->values[i + 1], f->values[i + 2]}, false);
      for (size_t c = 0; c < 3; ++c) f->values[i + c] = static_cast<float>(std::max(0.0, rgb[c]));
    }
  }

  ParameterList& params_;
  Lattice lattice_;
};

double temperature_offset(ParameterList& params) {
  const double cutoff = params.number("temperaturecutoff", 0, -1e6, 1e6);
  return params.number("temperatureoffset", cutoff, -1e6, 1e6);
}

void read_uniform(GridReader& reader, ParameterList& params, MediumGrid* grid, MediumDescription* medium) {
  grid->density = reader.field("density", ParamType::kFloat, 1);
  grid->temperature = reader.field("temperature", ParamType::kFloat, 1);
  const std::vector<double>* const scales = params.numbers("Lescale", ParamType::kFloat);
  if (scales != nullptr && scales->size() == 1 && reader.lattice().count() != 1) {
    const auto factor = static_cast<float>(std::clamp((*scales)[0], 0.0, kMostCoefficient));
    medium->emission = {medium->emission.r * factor, medium->emission.g * factor,
                        medium->emission.b * factor};
  } else if (scales != nullptr) {
    grid->emission = reader.field("Lescale", ParamType::kFloat, 1);
  } else {
    grid->emission = reader.one_voxel();
  }
  const double offset = temperature_offset(params);
  const double scale = params.number("temperaturescale", 1, 0, 1e6);
  if (grid->temperature == nullptr) return;
  if (!is_black(medium->emission)) params.odd_value("Le", "is not taken where there is a \"temperature\"");
  medium->emission = {1, 1, 1};
  auto kelvin = std::make_shared<VolumeField>(*grid->temperature);
  for (float& t : kelvin->values) t = static_cast<float>(std::clamp((t - offset) * scale, 0.0, 1e6));
  // Beyond the box there is pbrt's 0, less the offset.
  kelvin->outside = static_cast<float>(std::clamp(-offset * scale, 0.0, 1e6));
  grid->temperature = std::move(kelvin);
}

void read_rgb(GridReader& reader, ParameterList& params, MediumGrid* grid, MediumDescription* medium) {
  const double scale = params.number("scale", 1, 0, kMostCoefficient);
  grid->sigma_a = reader.field("sigma_a", ParamType::kRgb, scale);
  grid->sigma_s = reader.field("sigma_s", ParamType::kRgb, scale);
  const auto even = static_cast<float>(scale);
  medium->sigma_a = medium->sigma_s = {even, even, even};
  grid->emission = reader.field("Le", ParamType::kRgb, kLuminanceIntegral);
  const auto shown = static_cast<float>(params.number("Lescale", 1, 0, kMostCoefficient));
  medium->emission = grid->emission ? Rgb{shown, shown, shown} : Rgb{};
}

}  // namespace

std::shared_ptr<const MediumGrid> read_medium_grid(const std::string& type, ParameterList& params,
                                                   const Transform& ctm, MediumDescription* medium) {
  GridReader reader(params);
  auto grid = std::make_shared<MediumGrid>();
  grid->medium_to_world = ctm;
  if (!reader.read_lattice(type != "cloud")) return nullptr;
  grid->lo = reader.lattice().lo, grid->hi = reader.lattice().hi;
  if (type == "cloud") {
    const auto number = [&](const char* name, double fallback, double most) {
      return static_cast<float>(params.number(name, fallback, 0, most));
    };
    grid->cloud =
        CloudDensity{number("density", 1, 1e6), number("wispiness", 1, 1e3), number("frequency", 5, 1e4)};
    medium->emission = {};
    return grid;
  }
  const bool uniform = type == "uniformgrid";
  uniform ? read_uniform(reader, params, grid.get(), medium) : read_rgb(reader, params, grid.get(), medium);
  if (!grid->density && !grid->sigma_a && !grid->sigma_s) {
    reader.empty(uniform ? "needs a \"float density\" with a value for each voxel"
                         : "needs \"rgb sigma_a\" or \"rgb sigma_s\" with a value for each voxel");
    return nullptr;
  }
  return grid;
}

std::shared_ptr<const MediumGrid> refer_to_volume_file(PbrtScene& out, ParameterList& params,
                                                       const Transform& ctm, MediumDescription* medium) {
  const auto empty = [&](const std::string& why) {
    params.problems().warning(params.where(), params.owner() + " " + why + "; it is empty space");
    return nullptr;
  };
  const std::string name = params.text("filename", "");
  VolumeFile file;
  file.density = params.text("gridname", "density");
  file.temperature = params.text("temperaturename", "temperature");
  file.temperature_offset = temperature_offset(params);
  file.temperature_scale = params.number("temperaturescale", 1, 0, 1e6);
  const auto shown = static_cast<float>(params.number("Lescale", 1, 0, kMostCoefficient));
  medium->emission = {shown, shown, shown};
  if (name.empty()) return empty("needs a \"string filename\"");
  file.path = out.open_reference(name, params.where_of("filename"));
  if (file.path.empty()) return nullptr;
  std::vector<VolumeGridEntry> grids;
  try {
    grids = list_grids(file.path);
  } catch (const Error& error) {
    return empty("has a file, " + in_quotes(name) + ", that " + error.what());
  }
  const auto find = [&](const std::string& grid) {
    return std::ranges::find(grids, grid, &VolumeGridEntry::name);
  };
  if (find(file.density) == grids.end()) {
    std::string there;
    for (const VolumeGridEntry& g : grids) there += (there.empty() ? "" : ", ") + in_quotes(g.name);
    return empty("names the grid " + in_quotes(file.density) + ", which is not in " + in_quotes(name) +
                 (there.empty() ? "" : "; there are: " + there));
  }
  if (const std::string& why = find(file.density)->why_not; !why.empty())
    return empty("names the grid " + in_quotes(file.density) + ", which " + why);
  const auto hot = find(file.temperature);
  if (hot == grids.end() || !hot->why_not.empty()) {
    if (params.has("temperaturename"))
      params.odd_value("temperaturename",
                       "names no grid of temperatures in " + in_quotes(name) + "; nothing glows");
    file.temperature.clear();
    medium->emission = {};
  }
  auto grid = std::make_shared<MediumGrid>();
  grid->medium_to_world = ctm;
  grid->file = std::move(file);
  return grid;
}

}  // namespace lightmill
