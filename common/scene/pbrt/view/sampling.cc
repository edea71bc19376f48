// PixelFilter, Sampler, Integrator, Accelerator and Option.
#include <algorithm>

#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/syntax/params.h"

namespace lightmill {

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
  out.displacement_edge_scale = params.number("displacementedgescale", out.displacement_edge_scale, 0, 1e6);
  params.accept({"seed", "disabletexturefiltering", "disablewavelengthjitter", "msereferenceimage",
                 "msereferenceout", "rendercoordsys", "pixelstats", "wavefront"});
  params.finish();
}

}  // namespace lightmill
