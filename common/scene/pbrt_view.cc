// Camera, Film, PixelFilter, Sampler, Integrator, Accelerator and Option.
#include <algorithm>
#include <cmath>

#include "common/scene/pbrt_scene.h"
#include "common/scene/transform.h"
#include "common/settings.h"

namespace lightmill {
namespace {

constexpr double kAny = 3e38;

bool is_one_of(const std::string& word, const std::vector<std::string_view>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

void translate_camera(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm,
                      double* exposure_time) {
  static const std::vector<std::string_view> known = {"perspective", "orthographic", "realistic",
                                                      "spherical"};
  if (type == "realistic" || !is_one_of(type, known)) {
    if (is_one_of(type, known)) {
      out.problems->error(params.where(), "not supported yet: " + params.owner() + "; use \"perspective\"");
    } else {
      report_unknown_word(params, "camera", type, known);
    }
    return;
  }
  CameraDescription& camera = out.scene.camera;
  camera = CameraDescription{};
  camera.camera_to_world = inverse(ctm);
  if (type == "perspective") {
    camera.fov_degrees = params.number("fov", 90, 1e-4, 179.99);
    camera.lens_radius = params.number("lensradius", 0, 0, kAny);
    camera.focal_distance = params.number("focaldistance", 1e6, 1e-38, kAny);
  } else if (type == "spherical") {
    camera.kind = CameraKind::kSpherical;
    const std::string mapping = params.text("mapping", "equalarea");
    if (mapping == "equirectangular") {
      camera.mapping = SphericalMapping::kEquirectangular;
    } else if (mapping != "equalarea") {
      params.bad_value("mapping", "must be \"equalarea\" or \"equirectangular\", not " + in_quotes(mapping));
    }
    params.accept({"lensradius", "focaldistance"});  // without meaning here, as in pbrt
  } else {
    camera.kind = CameraKind::kOrthographic;
    if (params.number("lensradius", 0, 0, kAny) > 0)
      params.unsupported("lensradius", "is ignored: all is sharp");
    params.accept({"focaldistance"});
  }
  if (const auto* window = params.numbers("screenwindow", ParamType::kFloat, 4)) {
    camera.screen_window = {(*window)[0], (*window)[1], (*window)[2], (*window)[3]};
    if (!((*window)[0] < (*window)[1] && (*window)[2] < (*window)[3])) {
      params.bad_value("screenwindow", "must be x0 < x1, y0 < y1");
    }
  }
  if (params.has("frameaspectratio"))
    camera.frame_aspect_ratio = params.number("frameaspectratio", 1, 1e-5, 1e5);
  params.accept({"frameaspectratio"});
  const double opened = params.number("shutteropen", 0, -kAny, kAny);
  const double closed = params.number("shutterclose", 1, -kAny, kAny);
  *exposure_time = closed - opened;
  if (!(*exposure_time > 0)) {
    out.problems->error(params.where_of("shutterclose"), "the shutter must close after it opens");
    *exposure_time = 1;
  }
  params.finish();
}

void translate_film(PbrtScene& out, const std::string& type, ParameterList& params, double* iso_ratio,
                    double* exposure_time) {
  static const std::vector<std::string_view> known = {"rgb", "gbuffer", "spectral"};
  if (!is_one_of(type, known)) {
    report_unknown_word(params, "film", type, known);
    return;
  }
  if (type != "rgb") out.problems->unsupported(params.where(), params.owner() + " is rendered as \"rgb\"");
  FilmDescription& film = out.scene.film;
  film = FilmDescription{};
  film.width = static_cast<int>(params.integer("xresolution", 1280, 1, kMaxResolution));
  film.height = static_cast<int>(params.integer("yresolution", 720, 1, kMaxResolution));
  if (int64_t{film.width} * film.height > kMaxPixels) {
    params.bad_value("yresolution",
                     "makes an image of more than " + std::to_string(kMaxPixels) + " pixels; lower it");
  }
  film.filename = params.text("filename", "pbrt.exr");
  if (const auto* c = params.numbers("cropwindow", ParamType::kFloat, 4)) {
    film.crop = {(*c)[0], (*c)[1], (*c)[2], (*c)[3]};
    if (!(0 <= (*c)[0] && (*c)[0] < (*c)[1] && (*c)[1] <= 1 && 0 <= (*c)[2] && (*c)[2] < (*c)[3] &&
          (*c)[3] <= 1)) {
      params.bad_value("cropwindow", "must be x0 x1 y0 y1 with 0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1");
      film.crop.reset();
    }
  }
  if (const auto* b = params.numbers("pixelbounds", ParamType::kInteger, 4)) {
    const double w = film.width, h = film.height;
    if (film.crop) params.bad_value("pixelbounds", "can't be given together with \"cropwindow\"; keep one");
    if (0 <= (*b)[0] && (*b)[0] < (*b)[1] && (*b)[1] <= w && 0 <= (*b)[2] && (*b)[2] < (*b)[3] &&
        (*b)[3] <= h) {
      film.crop = {(*b)[0] / w, (*b)[1] / w, (*b)[2] / h, (*b)[3] / h};
    } else {
      params.bad_value("pixelbounds", "must be x0 x1 y0 y1, not empty and inside the film");
    }
  }
  *iso_ratio = params.number("iso", 100, 1e-6, 1e9) / 100;
  if (params.has("exposuretime")) *exposure_time = params.number("exposuretime", 1, 1e-9, 1e9);
  params.accept(
      {"diagonal", "savefp16", "exposuretime", "coordinatesystem", "nbuckets", "lambdamin", "lambdamax"});
  if (const std::string sensor = params.text("sensor", "cie1931"); sensor != "cie1931") {
    params.unsupported("sensor", in_quotes(sensor) + " is taken as \"cie1931\"");
  }
  if (params.number("whitebalance", 0, 0, 1e6) != 0) params.unsupported("whitebalance", "is ignored");
  if (params.has("maxcomponentvalue")) {
    params.number("maxcomponentvalue", kAny, 0, kAny);
    params.unsupported("maxcomponentvalue", "(clamping of samples) is ignored");
  }
  params.accept({"maxcomponentvalue"});
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
  } else {
    if (is_one_of(type, known)) {
      out.problems->unsupported(params.where(),
                                params.owner() + " is replaced by pbrt's default \"gaussian\"");
    } else {
      report_unknown_word(params, "pixel filter", type, known);
    }
    return;
  }
  filter.xradius = params.number("xradius", radius, kMinRadius, kMaxRadius);
  filter.yradius = params.number("yradius", radius, kMinRadius, kMaxRadius);
  params.finish();
}

void translate_sampler(PbrtScene& out, const std::string& type, ParameterList& params) {
  static const std::vector<std::string_view> known = {"halton", "independent", "paddedsobol", "pmj02bn",
                                                      "sobol",  "stratified",  "zsobol"};
  constexpr int64_t kMaxInt = 2147483647;
  if (!is_one_of(type, known)) {
    report_unknown_word(params, "sampler", type, known);
    return;
  }
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
  if (!is_one_of(type, known)) {
    report_unknown_word(params, "integrator", type, known);
    return;
  }
  SamplingDescription& sampling = out.scene.sampling;
  sampling.integrator = type;
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
  static const std::vector<std::string_view> known = {"bvh", "kdtree"};
  (void)out;
  if (!is_one_of(type, known)) {
    report_unknown_word(params, "accelerator", type, known);
    return;
  }
  params.accept({"maxnodeprims", "splitmethod", "intersectcost", "traversalcost", "emptybonus", "maxprims",
                 "maxdepth"});
  params.finish();
}

void translate_option(PbrtScene& out, ParameterList& params) {
  if (params.has("seed"))
    out.scene.sampling.seed = static_cast<uint64_t>(params.integer("seed", 0, 0, 2147483647));
  for (const char* name : {"disablepixeljitter", "forcediffuse", "displacementedgescale"}) {
    params.unsupported(name, "is ignored");
  }
  params.accept({"seed", "disabletexturefiltering", "disablewavelengthjitter", "msereferenceimage",
                 "msereferenceout", "rendercoordsys", "pixelstats", "wavefront"});
  params.finish();
}

}  // namespace lightmill
