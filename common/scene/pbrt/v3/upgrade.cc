#include "common/scene/pbrt/v3/upgrade.h"

#include <cmath>
#include <map>

#include "common/scene/pbrt/v3/direct_lighting.h"
#include "common/scene/pbrt/v3/edit.h"

namespace lightmill::v3 {
namespace {

/// What each upgrade works on.
struct Work {
  SourceLocation where;
  std::string* type;
  std::vector<Parameter>* parameters;
  ProblemList* problems;
  Edit edit{where, parameters};
  void warn(const std::string& message) const { problems->warning(where, message); }
};

/// The type in pbrt-v4's words.
void rename_type(const Work& w, const std::map<std::string_view, const char*>& names) {
  if (const auto found = names.find(*w.type); found != names.end()) *w.type = found->second;
}

void upgrade_camera(Work& w) {
  if (*w.type == "environment") {
    *w.type = "spherical";
    w.edit.set_words("mapping", ParamType::kString, {"equirectangular"});
  }
  w.edit.remove({"simpleweighting"});
  // The realistic camera of pbrt-v2's exercises.
  w.edit.rename("specfile", "lensfile");
  w.edit.rename("aperture_diameter", "aperturediameter");
  if (const Parameter* half = w.edit.find("halffov"); half != nullptr && half->numbers.size() == 1) {
    w.edit.set("fov", ParamType::kFloat, {2 * half->numbers[0]});
    w.edit.remove({"halffov"});
  }
}

void upgrade_film(Work& w) {
  rename_type(w, {{"image", "rgb"}});
  w.edit.rename("maxsampleluminance", "maxcomponentvalue");
  w.edit.set_default("xresolution", ParamType::kInteger, {640});
  w.edit.set_default("yresolution", ParamType::kInteger, {480});
  if (w.edit.has("scale")) {
    w.edit.set("iso", ParamType::kFloat, {100 * w.edit.number("scale", 1)});
    w.edit.remove({"scale"});
  }
  // v3 has no time of exposure: the shutter leaves the brightness alone.
  w.edit.set("exposuretime", ParamType::kFloat, {1});
  w.edit.remove({"writefrequency", "display"});
}

void upgrade_filter(Work& w) {
  w.edit.rename("xwidth", "xradius");
  w.edit.rename("ywidth", "yradius");
  if (*w.type != "gaussian") return;
  w.edit.set_default("xradius", ParamType::kFloat, {2});
  w.edit.set_default("yradius", ParamType::kFloat, {2});
  const double alpha = w.edit.number("alpha", 2);
  if (alpha > 0) w.edit.set("sigma", ParamType::kFloat, {1 / std::sqrt(2 * alpha)});
  w.edit.remove({"alpha"});
}

void upgrade_sampler(Work& w) {
  rename_type(w, {{"lowdiscrepancy", "paddedsobol"},
                  {"02sequence", "paddedsobol"},
                  {"maxmindist", "pmj02bn"},
                  {"random", "independent"},
                  {"bestcandidate", "independent"},
                  {"adaptive", "independent"}});
  w.edit.rename("maxsamples", "pixelsamples");  // of v2's "adaptive"
  w.edit.remove({"minsamples", "dimensions", "samplepixelcenter", "method"});
  if (*w.type != "stratified") w.edit.remove({"jitter"});
}

void upgrade_integrator(Work& w) {
  w.edit.remove({"rrthreshold", "imagewritefrequency", "numiterations", "lightsamplestrategy", "strategy",
                 "pixelbounds", "nsamples", "regularize"});
  if (is_direct_lighting(*w.type)) *w.type = "path";  // and its depth is chosen when the scene is complete
}

/// A colour named "scale" becomes a factor: of the light's colour where that is a colour, too.
void upgrade_scale(Work& w, std::string_view colour) {
  Parameter* const scale = w.edit.find("scale");
  if (scale == nullptr || scale->type == ParamType::kFloat) return;
  if (const auto grey = grey_value(*scale)) {
    w.edit.set("scale", ParamType::kFloat, {*grey});
    return;
  }
  Parameter* const c = w.edit.find(colour);
  const bool both = scale->type == ParamType::kRgb && scale->numbers.size() == 3 &&
                    (c == nullptr || (c->type == ParamType::kRgb && c->numbers.size() == 3));
  if (both) {
    std::vector<double> product = scale->numbers;
    for (size_t i = 0; c != nullptr && i < 3; ++i) product[i] *= c->numbers[i];
    w.edit.set(colour, ParamType::kRgb, std::move(product));
  } else {
    w.warn("a light's \"scale\" that is a spectrum is left out; give its colour as one");
  }
  w.edit.remove({"scale"});
}

void upgrade_light(Work& w) {
  rename_type(w, {{"exinfinite", "infinite"}});
  const std::string_view colour = *w.type == "distant" || *w.type == "infinite" ? "L" : "I";
  upgrade_scale(w, colour);
  upgrade_blackbody(w.parameters);
  w.edit.rename("mapname", "filename");
  w.edit.remove({"samples", "nsamples"});
  if (*w.type == "projection") w.edit.set_default("fov", ParamType::kFloat, {45});
}

void upgrade_area_light(Work& w) {
  rename_type(w, {{"area", "diffuse"}});
  upgrade_scale(w, "L");
  upgrade_blackbody(w.parameters);
  w.edit.remove({"samples", "nsamples"});
}

void upgrade_texture(Work& w) {
  if (*w.type == "imagemap" || *w.type == "ptex") {
    if (const Parameter* tri = w.edit.find("trilinear"); tri != nullptr && tri->type == ParamType::kBool) {
      const bool on = !tri->numbers.empty() && tri->numbers[0] != 0;
      w.edit.set_words("filter", ParamType::kString, {on ? "trilinear" : "bilinear"});
    }
    w.edit.remove({"trilinear"});
    if (const Parameter* gamma = w.edit.find("gamma"); gamma != nullptr && gamma->numbers.size() == 1) {
      const double value = gamma->numbers[0];
      const std::string encoding = gamma->type != ParamType::kBool ? "gamma " + std::to_string(value)
                                   : value != 0                    ? "sRGB"
                                                                   : "linear";
      w.edit.set_words("encoding", ParamType::kString, {encoding});
    }
    w.edit.remove({"gamma"});
  } else if (*w.type == "scale") {
    // v4 has a texture and a float that scales it; v3 had two textures, in any order.
    const Parameter *first = w.edit.find("tex1"), *second = w.edit.find("tex2");
    const bool swapped = second != nullptr && second->type == ParamType::kTexture &&
                         (first == nullptr || first->type != ParamType::kTexture);
    w.edit.rename(swapped ? "tex2" : "tex1", "tex");
    w.edit.rename(swapped ? "tex1" : "tex2", "scale");
    if (Parameter* scale = w.edit.find("scale"); scale != nullptr && scale->type != ParamType::kTexture) {
      if (const auto grey = grey_value(*scale)) w.edit.set("scale", ParamType::kFloat, {*grey});
    }
  } else if (*w.type == "dots") {
    // v4 draws the dots in the colour of "outside"; v3 as its documentation says.
    w.edit.rename("inside", "dots");
    w.edit.rename("outside", "inside");
    w.edit.rename("dots", "outside");
  }
  w.edit.remove({"aamode"});
}

void upgrade_shape(Work& w) {
  w.edit.rename("nlevels", "levels");
  w.edit.rename("st", "uv");
  w.edit.remove({"discarddegenerateUVs", "shadowalpha"});
  if (Parameter* uv = w.edit.find("uv"); uv != nullptr && uv->type == ParamType::kFloat)
    uv->type = ParamType::kPoint2;
}

void upgrade_medium(Work& w) {
  if (w.edit.text("type", "") == "heterogeneous")
    w.edit.set_words("type", ParamType::kString, {"uniformgrid"});
  if (w.edit.has("preset")) return;
  w.edit.set_default("sigma_a", ParamType::kRgb, {.0011, .0024, .014});
  w.edit.set_default("sigma_s", ParamType::kRgb, {2.55, 3.21, 3.77});
}

}  // namespace

void upgrade_blackbody(std::vector<Parameter>* parameters) {
  double scale = 1;
  SourceLocation where;
  for (Parameter& p : *parameters) {
    if (p.type != ParamType::kBlackbody || p.numbers.size() != 2) continue;
    scale *= p.numbers[1];
    p.numbers.pop_back();
    where = p.where;
  }
  if (scale == 1) return;
  Edit edit(where, parameters);
  edit.set("scale", ParamType::kFloat, {scale * edit.number("scale", 1)});
}

void upgrade(Directive directive, const SourceLocation& where, std::string* type,
             std::vector<Parameter>* parameters, ProblemList* problems) {
  Work w{where, type, parameters, problems};
  switch (directive) {
    case Directive::kCamera:
      return upgrade_camera(w);
    case Directive::kFilm:
      return upgrade_film(w);
    case Directive::kPixelFilter:
      return upgrade_filter(w);
    case Directive::kSampler:
      return upgrade_sampler(w);
    case Directive::kIntegrator:
      return upgrade_integrator(w);
    case Directive::kLight:
      return upgrade_light(w);
    case Directive::kAreaLight:
      return upgrade_area_light(w);
    case Directive::kTexture:
      return upgrade_texture(w);
    case Directive::kShape:
      return upgrade_shape(w);
    case Directive::kMedium:
      return upgrade_medium(w);
  }
}

}  // namespace lightmill::v3
