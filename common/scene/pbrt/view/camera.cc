// Camera.
#include <algorithm>
#include <cmath>

#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/syntax/params.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr size_t kMostElements = 100;
constexpr int kMostBlades = 1000;
constexpr size_t kMostOpenness = 1024;

/// Elements of a lens description file: four numbers each, radius, thickness, index and diameter, in mm.
std::vector<LensElement> read_lens_file(PbrtScene& out, ParameterList& params) {
  const std::string file = params.text("lensfile", "");
  if (file.empty()) {
    out.problems->error(params.where(), params.owner() + " needs a \"string lensfile\"");
    return {};
  }
  const std::string path = out.open_reference(file, params.where_of("lensfile"));
  if (path.empty()) return {};
  const std::vector<double> n = read_number_file(path);
  if (n.empty() || n.size() % 4 != 0 || n.size() / 4 > kMostElements) {
    params.bad_value("lensfile", "needs a file of up to " + std::to_string(kMostElements) +
                                     " rows of four numbers: radius, thickness, index, diameter");
    return {};
  }
  std::vector<LensElement> elements;
  for (size_t i = 0; i < n.size(); i += 4) {
    const LensElement& e = elements.emplace_back(LensElement{n[i], n[i + 1], n[i + 2], n[i + 3]});
    // Between 1e-6 mm and 1000 km: squares stay within float.
    const double radius = std::abs(e.radius);
    const bool good = (radius == 0 || (radius > 1e-6 && radius < 1e9)) && e.thickness >= 0 &&
                      e.thickness < 1e9 && (e.eta == 0 || (e.eta >= 0.1 && e.eta <= 10)) &&
                      e.diameter > 1e-6 && e.diameter < 1e9;
    if (good) continue;
    params.bad_value("lensfile", "has an element that can't be, in its row " + std::to_string(i / 4 + 1));
    return {};
  }
  if (elements.back().radius == 0) {
    params.bad_value("lensfile", "ends with the stop; the last element must be a lens");
    return {};
  }
  return elements;
}

void read_lenses(PbrtScene& out, ParameterList& params, LensSystem* lens) {
  lens->elements = read_lens_file(out, params);
  if (params.has("filmdiag")) out.film_diagonal = params.number("filmdiag", 35, 1e-3, 1e6);
  lens->aperture_diameter = params.number("aperturediameter", 1, 1e-6, 1e9);
  lens->focus_distance = params.number("focusdistance", 10, 1e-6, 1e9);
  for (const LensElement& e : lens->elements) {
    if (e.radius != 0 || lens->aperture_diameter <= e.diameter) continue;
    out.problems->warning(params.where_of("aperturediameter"),
                          "the aperture's diameter is larger than the stop, which has " +
                              std::to_string(e.diameter) + " mm; that is taken");
  }
  const std::string aperture = params.text("aperture", "");
  if (aperture.empty() || is_one_of(aperture, {"gaussian", "square", "pentagon", "star"})) {
    lens->aperture = aperture;
  } else {
    lens->aperture = out.open_reference(aperture, params.where_of("aperture"));
  }
}

/// Blender's range of an equirectangular camera (ours), if some of it is given.
void read_range(ParameterList& params, CameraDescription* camera) {
  const PanoramaRange whole;
  PanoramaRange range;
  range.longitude_min = params.number("longitudemin", whole.longitude_min, -360, 360);
  range.longitude_max = params.number("longitudemax", whole.longitude_max, -360, 360);
  range.latitude_min = params.number("latitudemin", whole.latitude_min, -90, 90);
  range.latitude_max = params.number("latitudemax", whole.latitude_max, -90, 90);
  const bool given = params.has("longitudemin") || params.has("longitudemax") || params.has("latitudemin") ||
                     params.has("latitudemax");
  if (!given) return;
  if (camera->mapping != SphericalMapping::kEquirectangular) {
    params.odd_value("longitudemin",
                     "and its like are for the mapping \"equirectangular\"; they are left out");
    return;
  }
  constexpr double kLeast = 1e-3;
  if (!(range.longitude_max - range.longitude_min >= kLeast) ||
      !(range.longitude_max - range.longitude_min <= 360 + kLeast) ||
      !(range.latitude_max - range.latitude_min >= kLeast)) {
    params.odd_value("longitudemin",
                     "and its like must be a range that grows, of 360 degrees at most; the whole "
                     "one is taken");
    range = whole;
  }
  camera->range = range;
}

/// Blender's fisheyes (ours).
void read_fisheye(ParameterList& params, FisheyeLens* lens) {
  const std::string projection = params.text("projection", "equidistant");
  if (projection == "equisolid") {
    lens->projection = FisheyeProjection::kEquisolid;
  } else if (projection == "mirrorball") {
    lens->projection = FisheyeProjection::kMirrorBall;
  } else if (projection == "polynomial") {
    lens->projection = FisheyeProjection::kPolynomial;
  } else if (projection != "equidistant") {
    params.odd_value("projection",
                     "must be \"equidistant\", \"equisolid\", \"mirrorball\" or \"polynomial\", not " +
                         in_quotes(projection) + "; \"equidistant\" is taken");
  }
  lens->fov_degrees = params.number("fov", 180, 1e-3, 360);
  lens->focal_length = params.number("lens", 10.5, 1e-6, 1e6);
  lens->sensor_width = params.number("sensorwidth", 36, 1e-6, 1e6);
  lens->sensor_height = params.number("sensorheight", 24, 1e-6, 1e6);
  if (const auto* given = params.numbers("coefficients", ParamType::kFloat, lens->coefficients.size())) {
    const std::vector<double>& c = *given;
    if (c[1] > 0 && std::all_of(c.begin(), c.end(), [](double x) { return std::abs(x) <= 1e6; })) {
      std::copy(c.begin(), c.end(), lens->coefficients.begin());
    } else {
      params.odd_value("coefficients",
                       "must make an angle that grows from the middle of the picture on; "
                       "0.02 radians to a mm are taken");
    }
  }
}

/// x0 x1 y0 y1, in any order: one that goes backwards turns the picture's right into its left, or its top
/// into its bottom, as in pbrt. The caller turns the camera then.
void set_screen_window(PbrtScene& out, const std::vector<double>& w, CameraDescription* camera) {
  out.flips_x = w[0] > w[1];
  out.flips_y = w[2] > w[3];
  const double x = out.flips_x ? -1 : 1, y = out.flips_y ? -1 : 1;
  camera->screen_window = {x * w[0], x * w[1], y * w[2], y * w[3]};
}

/// ShutterDescription::openness by "float shuttercurve", which is ours.
std::vector<double> openness_of(ParameterList& params) {
  const std::vector<double>* values = params.numbers("shuttercurve", ParamType::kFloat);
  if (!values) return {};
  const bool good =
      values->size() >= 2 && values->size() <= kMostOpenness &&
      std::all_of(values->begin(), values->end(), [](double x) { return x >= 0 && x <= 1e6; }) &&
      std::any_of(values->begin(), values->end(), [](double x) { return x > 0; });
  if (good) return *values;
  params.odd_value("shuttercurve", "must be 2 to " + std::to_string(kMostOpenness) +
                                       " numbers from 0 on, not all of them 0; it is left out");
  return {};
}

}  // namespace

void translate_camera(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm,
                      MotionTimes* times) {
  static const std::vector<std::string_view> known = {"perspective", "orthographic", "realistic", "spherical",
                                                      "fisheye"};
  if (!is_one_of(type, known)) report_unknown_word(params, "camera", type, known, "\"perspective\" is taken");
  CameraDescription& camera = out.scene.camera;
  camera = CameraDescription{};
  camera.camera_to_world = inverse(ctm);
  if (type == "spherical") {
    camera.kind = CameraKind::kSpherical;
    const std::string mapping = params.text("mapping", "equalarea");
    if (mapping == "equirectangular") {
      camera.mapping = SphericalMapping::kEquirectangular;
    } else if (mapping != "equalarea") {
      params.odd_value("mapping", "must be \"equalarea\" or \"equirectangular\", not " + in_quotes(mapping) +
                                      "; \"equalarea\" is taken");
    }
    read_range(params, &camera);
    params.accept({"lensradius", "focaldistance"});  // without meaning here, as in pbrt
  } else if (type == "fisheye") {
    camera.kind = CameraKind::kFisheye;
    read_fisheye(params, &camera.fisheye);
    params.accept({"lensradius", "focaldistance"});
  } else if (type == "realistic") {
    camera.kind = CameraKind::kRealistic;
    read_lenses(out, params, &camera.lens);
    params.accept({"screenwindow", "frameaspectratio"});  // the film has a size of its own
  } else if (type == "orthographic") {
    camera.kind = CameraKind::kOrthographic;
    camera.lens_radius = params.number("lensradius", 0, 0, kAnySize);
    camera.focal_distance = params.number("focaldistance", 1e6, 1e-38, kAnySize);
    if (camera.lens_radius > 0) {
      out.problems->warning(
          params.where_of("lensradius"),
          "an orthographic camera with a lens stays orthographic here; pbrt-v4 lets all its rays "
          "start around one point, as a perspective camera's");
    }
  } else {
    camera.fov_degrees = params.number("fov", 90, 1e-4, 179.99);
    camera.blades.count = static_cast<int>(params.integer("blades", 0, 0, kMostBlades));
    camera.blades.rotation_degrees = params.number("bladerotation", 0, -kAnySize, kAnySize);
    camera.blades.ratio = params.number("apertureratio", 1, 1e-3, 1e3);
    camera.lens_radius = params.number("lensradius", 0, 0, kAnySize);
    camera.focal_distance = params.number("focaldistance", 1e6, 1e-38, kAnySize);
  }
  if (const auto* window = params.numbers("screenwindow", ParamType::kFloat, 4)) {
    const std::vector<double>& w = *window;
    if (w[0] == w[1] || w[2] == w[3]) {
      params.odd_value("screenwindow", "must be x0 < x1, y0 < y1; it is left out");
    } else {
      set_screen_window(out, w, &camera);
    }
  }
  if (params.has("frameaspectratio"))
    camera.frame_aspect_ratio = params.number("frameaspectratio", 1, 1e-5, 1e5);
  params.accept({"frameaspectratio"});
  times->shutter_opens = params.number("shutteropen", 0, -kAnySize, kAnySize);
  times->shutter_closes = params.number("shutterclose", 1, -kAnySize, kAnySize);
  if (!(times->shutter_opens < times->shutter_closes)) {
    out.problems->warning(params.where_of("shutterclose"),
                          "the shutter must close after it opens; 0 and 1 are taken");
    times->shutter_opens = 0;
    times->shutter_closes = 1;
  }
  out.scene.shutter.openness = openness_of(params);
  params.finish();
}

}  // namespace lightmill
