// Camera, Film, PixelFilter, Sampler, Integrator, Accelerator and Option.
#include <algorithm>
#include <cmath>

#include "common/job/settings.h"
#include "common/scene/pbrt/params.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/spectrum/sensor.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

bool is_one_of(const std::string& word, const std::vector<std::string_view>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

constexpr size_t kMostElements = 100;

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

}  // namespace

namespace {

/// x0 x1 y0 y1, in any order: one that goes backwards turns the picture's right into its left, or its top
/// into its bottom, as in pbrt. The caller turns the camera then.
void set_screen_window(PbrtScene& out, const std::vector<double>& w, CameraDescription* camera) {
  out.flips_x = w[0] > w[1];
  out.flips_y = w[2] > w[3];
  const double x = out.flips_x ? -1 : 1, y = out.flips_y ? -1 : 1;
  camera->screen_window = {x * w[0], x * w[1], y * w[2], y * w[3]};
}

}  // namespace

void translate_camera(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm,
                      MotionTimes* times) {
  static const std::vector<std::string_view> known = {"perspective", "orthographic", "realistic",
                                                      "spherical"};
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
    params.accept({"lensradius", "focaldistance"});  // without meaning here, as in pbrt
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
  params.finish();
}

namespace {

void read_sensor(ParameterList& params, FilmDescription* film) {
  const std::string name = params.text("sensor", "cie1931");
  const std::optional<ColorMatrix> sensor = sensor_named(name);
  if (!sensor)
    params.odd_value("sensor",
                     "is unknown, and is left out: " + in_quotes(name) + nearest_hint(name, sensor_names()));
  const double white = params.number("whitebalance", 0, 0, 1e6);
  if (white != 0 && white < kLeastWhiteBalance) {
    params.odd_value("whitebalance", "needs a temperature of at least " +
                                         std::to_string(static_cast<int>(kLeastWhiteBalance)) +
                                         " kelvin; it is left out");
  } else if (sensor) {
    // Sensors that pbrt has measured are balanced for 6500 K unless they are told otherwise.
    film->sensor = white == 0 ? *sensor : product(*sensor, white_balance(white));
  }
  film->most = params.number("maxcomponentvalue", kAnySize, 0, kAnySize);
  if (film->most >= 1e30) film->most = 0;  // never reached
}

/// The layers of pbrt's film that there are, by the names that they have here.
void read_gbuffer(PbrtScene& out, ParameterList& params, FilmDescription* film) {
  film->aovs = kAovAlbedo | kAovNormal | kAovPosition | kAovVariance;
  const std::string system = params.text("coordinatesystem", "camera");
  if (system != "camera" && system != "world")
    params.odd_value("coordinatesystem", "must be \"camera\" or \"world\", not " + in_quotes(system));
  out.problems->unsupported(params.where(), params.owner() + " records the layers " + aov_names(film->aovs) +
                                                (system == "camera" ? ", in world space," : "") +
                                                " and no others");
}

}  // namespace

namespace {

/// x0 x1 y0 y1 in [0, 1] of the film, in order; nothing (reported) if they are none, or hold no pixel.
std::optional<std::array<double, 4>> crop_within(const char* name, std::array<double, 4> c,
                                                 ParameterList& params) {
  const std::array<double, 4> given = c;
  if (c[0] > c[1]) std::swap(c[0], c[1]);
  if (c[2] > c[3]) std::swap(c[2], c[3]);
  for (double& x : c) x = std::clamp(x, 0.0, 1.0);
  const bool is_empty = !(c[0] < c[1] && c[2] < c[3]);
  if (is_empty || c != given) {
    params.odd_value(name, std::string("must be x0 < x1, y0 < y1, not empty and inside the film; ") +
                               (is_empty ? "it is left out" : "it is cut to that"));
  }
  return is_empty ? std::nullopt : std::optional(c);
}

}  // namespace

void translate_film(PbrtScene& out, const std::string& type, ParameterList& params, double* iso_ratio,
                    double* exposure_time) {
  static const std::vector<std::string_view> known = {"rgb", "gbuffer", "spectral"};
  if (!is_one_of(type, known)) report_unknown_word(params, "film", type, known, "\"rgb\" is taken");
  FilmDescription& film = out.scene.film;
  film = FilmDescription{};
  if (type == "spectral")
    out.problems->unsupported(params.where(),
                              params.owner() + " is rendered as \"rgb\": it has no buckets of wavelengths");
  if (type == "gbuffer") read_gbuffer(out, params, &film);
  film.width = static_cast<int>(params.integer("xresolution", 1280, 1, kMaxResolution));
  film.height = static_cast<int>(params.integer("yresolution", 720, 1, kMaxResolution));
  if (int64_t{film.width} * film.height > kMaxPixels) {
    params.bad_value("yresolution",
                     "makes an image of more than " + std::to_string(kMaxPixels) + " pixels; lower it");
  }
  film.filename = params.text("filename", "pbrt.exr");
  if (const auto* c = params.numbers("cropwindow", ParamType::kFloat, 4))
    film.crop = crop_within("cropwindow", {(*c)[0], (*c)[1], (*c)[2], (*c)[3]}, params);
  if (const auto* b = params.numbers("pixelbounds", ParamType::kInteger, 4)) {
    const double w = film.width, h = film.height;
    if (film.crop) params.odd_value("pixelbounds", "is given together with \"cropwindow\", and counts");
    film.crop = crop_within("pixelbounds", {(*b)[0] / w, (*b)[1] / w, (*b)[2] / h, (*b)[3] / h}, params);
  }
  *iso_ratio = params.number("iso", 100, 1e-6, 1e9) / 100;
  if (params.has("exposuretime")) *exposure_time = params.number("exposuretime", 1, 1e-9, 1e9);
  out.film_diagonal = params.number("diagonal", 35, 1e-3, 1e6);
  params.accept({"savefp16", "exposuretime", "coordinatesystem", "nbuckets", "lambdamin", "lambdamax"});
  read_sensor(params, &film);
  params.finish();
}

void translate_filter(PbrtScene& out, const std::string& type, ParameterList& params) {
  static const std::vector<std::string_view> known = {"box", "triangle", "gaussian", "mitchell", "sinc"};
  FilterDescription& filter = out.scene.filter;
  filter = FilterDescription{};
  constexpr double kMinRadius = 1e-3, kMaxRadius = 64;
  double radius = 1.5;
  if (type == "box") {
    filter.kind = FilterKind::kBox;
    radius = 0.5;
  } else if (type == "triangle") {
    filter.kind = FilterKind::kTriangle;
    radius = 2;
  } else if (type == "gaussian") {
    filter.kind = FilterKind::kGaussian;
    filter.sigma = params.number("sigma", 0.5, 1e-3, 1e3);
  } else if (type == "mitchell") {
    filter.kind = FilterKind::kMitchell;
    radius = 2;
    filter.b = params.number("B", 1.0 / 3, -10, 10);
    filter.c = params.number("C", 1.0 / 3, -10, 10);
  } else if (type == "sinc") {
    filter.kind = FilterKind::kSinc;
    radius = 4;
    filter.tau = params.number("tau", 3, 1e-3, 1e3);
  } else {
    report_unknown_word(params, "pixel filter", type, known, "\"gaussian\" is taken");
  }
  filter.xradius = params.number("xradius", radius, kMinRadius, kMaxRadius);
  filter.yradius = params.number("yradius", radius, kMinRadius, kMaxRadius);
  params.finish();
}

void translate_sampler(PbrtScene& out, const std::string& type, ParameterList& params) {
  static const std::vector<std::string_view> known = {"halton", "independent", "paddedsobol", "pmj02bn",
                                                      "sobol",  "stratified",  "zsobol"};
  constexpr int64_t kMaxInt = 2147483647;
  if (!is_one_of(type, known)) report_unknown_word(params, "sampler", type, known, "ours is taken");
  SamplingDescription& sampling = out.scene.sampling;
  if (type == "stratified") {
    sampling.spp = params.integer("xsamples", 4, 1, 46340) * params.integer("ysamples", 4, 1, 46340);
    params.accept({"jitter"});
  } else {
    sampling.spp = params.integer("pixelsamples", 16, 1, kMaxInt);
    params.accept({"randomization"});
  }
  if (params.has("seed")) sampling.seed = static_cast<uint64_t>(params.integer("seed", 0, 0, kMaxInt));
  params.accept({"seed"});
  params.finish();
}

void translate_integrator(PbrtScene& out, const std::string& type, ParameterList& params) {
  static const std::vector<std::string_view> known = {
      "path", "simplepath",       "lightpath",  "simplevolpath", "volpath", "bdpt",
      "mlt",  "ambientocclusion", "randomwalk", "sppm",          "function"};
  const bool is_known = is_one_of(type, known);
  if (!is_known) report_unknown_word(params, "integrator", type, known, "\"volpath\" is taken");
  SamplingDescription& sampling = out.scene.sampling;
  sampling.integrator = is_known ? type : "volpath";
  out.media_left_out.reset();
  if (is_known && !is_one_of(type, {"volpath", "simplevolpath", "bdpt", "mlt"}))
    out.media_left_out = params.where();
  sampling.max_depth = static_cast<int>(params.integer("maxdepth", 5, 0, 2147483647));
  sampling.max_depth = std::min(sampling.max_depth, kUnlimitedDepth);
  if (params.boolean("regularize", false)) params.unsupported("regularize", "is ignored");
  // They steer how an integrator finds light, not what the picture converges to.
  params.accept({"lightsampler",
                 "samplelights",
                 "samplebsdf",
                 "visualizestrategies",
                 "visualizeweights",
                 "bootstrapsamples",
                 "chains",
                 "mutationsperpixel",
                 "largestepprobability",
                 "sigma",
                 "radius",
                 "photonsperiteration",
                 "seed",
                 "iterations",
                 "cossample",
                 "maxdistance",
                 "function",
                 "filename",
                 "imagefilename",
                 "skipbad"});
  params.finish();
}

void translate_accelerator(PbrtScene& out, const std::string& type, ParameterList& params) {
  static const std::vector<std::string_view> known = {"bvh", "kdtree"}, old = {"grid", "qbvh", "none"};
  if (out.dialect == Dialect::kV3 && is_one_of(type, old)) return;
  if (!is_one_of(type, known)) report_unknown_word(params, "accelerator", type, known, "ours is taken");
  params.accept({"maxnodeprims", "splitmethod", "intersectcost", "traversalcost", "emptybonus", "maxprims",
                 "maxdepth"});
  params.finish();
}

void translate_option(PbrtScene& out, ParameterList& params) {
  if (params.has("seed"))
    out.scene.sampling.seed = static_cast<uint64_t>(params.integer("seed", 0, 0, 2147483647));
  for (const char* name : {"disablepixeljitter", "forcediffuse"}) {
    if (params.boolean(name, false)) params.unsupported(name, "is ignored");
  }
  // The edge scale is of displacements of shapes, each of which is warned of.
  params.accept({"seed", "displacementedgescale", "disabletexturefiltering", "disablewavelengthjitter",
                 "msereferenceimage", "msereferenceout", "rendercoordsys", "pixelstats", "wavefront"});
  params.finish();
}

}  // namespace lightmill
