// Film.
#include <algorithm>

#include "common/job/settings.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/syntax/params.h"
#include "common/scene/spectrum/sensor.h"

namespace lightmill {
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
  out.film_diagonal = params.number("diagonal", out.film_diagonal, 1e-3, 1e6);
  params.accept({"savefp16", "exposuretime", "coordinatesystem", "nbuckets", "lambdamin", "lambdamax"});
  read_sensor(params, &film);
  params.finish();
}

}  // namespace lightmill
