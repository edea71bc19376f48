#include "worker/render/plan/analysis/scene_analysis.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "worker/render/accel/few_primitives.h"
#include "worker/render/guiding/training/emission_guide_training.h"
#include "worker/render/plan/analysis/path_classes.h"
#include "worker/render/plan/analysis/stage_kernels.h"
#include "worker/render/scene/media/subsurface_body.h"

namespace lightmill {
namespace {

/// What a set of strategies finds: walks that suffice bring its camera paths what light paths would.
Strategies with_walks(const RenderScene& scene, Strategies set) {
  return scene.manifolds.suffice() && set & kCameraLayer ? set | kLightPaths : set;
}
PathClasses found_by(const RenderScene& scene, int max_depth, Strategies set) {
  return paths_made(scene, max_depth, with_walks(scene, set));
}

/// How much of the grids is walked through, and how.
std::string grids_in_words(const VolumeTable& volumes) {
  if (volumes.empty()) return "no medium varies";
  size_t bricks = 0, tracked = 0, integrated = 0;
  for (size_t record = 0; record < volumes.records.size(); record += kGridFloats) {
    const float* const field = &volumes.records[record + kGridCoefficients];
    const auto integer = [&](size_t slot) {
      return static_cast<size_t>(std::bit_cast<int32_t>(field[slot]));
    };
    const size_t first = integer(kFieldFirst);
    const size_t count = integer(kFieldBricks) * integer(kFieldBricks + 1) * integer(kFieldBricks + 2);
    for (size_t b = first; b < first + count; ++b) {
      tracked += volumes.majorants[b] > 0;
      integrated += volumes.majorants[b] < 0;
    }
    bricks += count;
  }
  const auto count = [](size_t n) { return std::to_string(n); };
  return count(volumes.records.size() / kGridFloats) + " grid(s): of " + count(bricks) + " bricks " +
         count(tracked) + " are tracked, " + count(integrated) +
         " are integrated, as they only absorb or are dense, and the others are skipped";
}

/// What each set of strategies finds.
void find_strategies(const RenderScene& scene, int max_depth, ScenePlan* plan) {
  plan->useful = 0;
  std::array<PathClasses, kAllStrategies + 1> made;
  for (Strategies set = 0; set <= kAllStrategies; ++set) {
    made[set] = paths_made(scene, max_depth, set);
    const bool is_family = set && !(set & (set - 1));
    if (is_family && made[set]) plan->useful |= set & plan->possible;
  }
  for (Strategies set = 0; set <= kAllStrategies; ++set)
    plan->complete[set] = (made[plan->possible] & ~made[with_walks(scene, set)]) == 0;
}

/// ScenePlan::lost_light of `strategies`, called `chosen`.
std::string lost_light(const RenderScene& scene, int max_depth, Strategies possible, Strategies strategies,
                       const std::string& chosen) {
  const PathClasses lost =
      paths_made(scene, max_depth, kAllStrategies) & ~found_by(scene, max_depth, strategies);
  if (!lost) return {};
  const PathClasses found = lost & paths_made(scene, max_depth, possible);
  return chosen + " leaves out light of paths " + shortest_path(found ? found : lost) +
         " (S: a mirror or smooth glass, D: anything else)" +
         (found ? ", which --integrator auto finds" : "; with hair or a realistic camera nothing finds it");
}

}  // namespace

ScenePlan analyse_scene(const RenderScene& scene, const Camera& camera, const RadianceScale& radiance,
                        const MissingLight& missing, const RenderSettings& settings, Strategies possible,
                        Strategies strategies) {
  ScenePlan plan;
  plan.possible = possible;
  plan.quantum_exponent = radiance.quantum_exponent();
  plan.primitives = static_cast<int64_t>(scene.primitive_material.size());
  find_strategies(scene, settings.max_depth, &plan);
  const bool guided_emission = uses_emission_guide(scene, plan_of(settings), strategies);
  const LightTable& lights = scene.lights_of(guided_emission);
  plan.kernels = stage_kernels(scene, lights);
  auto item = [&](const char* feature, bool needed, std::string reason, std::string saving,
                  Features bit = 0) {
    if (settings.overrides & bit) reason = "kept by --plan-override";
    plan.items.push_back(
        {feature, needed, std::move(reason), needed ? std::string() : std::move(saving), bit});
  };
  const auto text = [](auto n) { return std::to_string(n); };
  const std::string chosen =
      settings.plan ? "the sampling plan" : std::string(integrator_name(settings.integrator));
  plan.lost_light = lost_light(scene, settings.max_depth, possible, strategies, chosen);
  plan.missing = missing.up_to(settings.max_depth);
  plan.missing_light = missing_light_text(plan.missing);

  const bool masked = std::any_of(scene.meshes.begin(), scene.meshes.end(),
                                  [](const MeshRange& mesh) { return mesh.alpha.texture >= 0; });
  const size_t unused = scene.textures.unused_images();
  item("textures", scene.any_texture || scene.any_bumps || masked,
       std::string(scene.any_texture ? "a material or emitter in use reads one"
                   : scene.any_bumps ? "normal and bump maps alone read one"
                   : masked          ? "alpha masks alone read one"
                                     : "nothing in use reads one") +
           (unused ? ", and " + text(unused) + " image(s) that nothing in use reads are not loaded"
                   : std::string()),
       "texture evaluation per hit", kTextures);
  item("texture coordinates", !scene.uvs.empty(),
       scene.uvs.empty()        ? "nothing reads them"
       : settings.aovs & kAovUv ? "the AOV uv records them"
                                : "a texture reads them",
       "8 bytes per vertex and their interpolation per hit", kTextureCoordinates);
  item("shading normals", scene.any_normals,
       scene.any_normals ? "a mesh has vertex normals" : "no mesh has vertex normals",
       "12 bytes per vertex, their interpolation and the adjoint correction per hit", kShadingNormals);
  item("normal and bump maps", scene.any_bumps,
       scene.any_bumps ? "a material in use has one" : "no material in use has one",
       "tangents and texture evaluations per hit", kBumps);
  item("anisotropic lobes", scene.any_anisotropy,
       scene.any_anisotropy ? "a roughness differs along and across the surface's u"
                            : "every roughness is the same all round",
       "the tangent and its rotation per hit", kAnisotropicLobes);
  item("alpha masks", scene.any_alpha,
       scene.any_alpha ? "a shape has an alpha below 1 or textured" : "every shape is opaque",
       "a callback per crossing of a masked shape", kAlphaMasks);
  item("fibres", scene.any_fibres,
       scene.any_fibres ? "there is hair or a flat curve, which camera paths alone can see"
                        : "there is no hair, nor a flat curve",
       "a callback per crossing of a fibre, and its turn to the viewer per hit");
  item("mixes", scene.any_mix, scene.any_mix ? "a material in use is a mix" : "no material in use is a mix",
       "the choice of a material per hit", kMixes);
  item("subsurface scattering", scene.any_bodies,
       scene.any_bodies ? "light walks through bodies of " + text(scene.bodies.size() / kBodyFloats) +
                              " subsurface material(s)"
                        : "no material in use lets light into a body",
       "the walk between where a path enters and where it leaves");
  item("material sort", scene.kinds_present > 1, text(scene.kinds_present) + " BSDF kind(s) in use",
       "a counting sort per bounce", kMaterialSort);
  item("delta events", scene.any_delta,
       scene.any_delta ? "a smooth metal, glass or coat is in use" : "no smooth metal, glass or coat",
       "their flags, where diffuse kernels do; general ones carry them");
  item(
      "general kernels", plan.kernels.paths != KernelSet::kDiffuse, reason_of(scene, lights, plan.kernels),
      "the choice of a BSDF and of a kind of light, delta events and look-ups: a twentieth of the time of pt "
      "and a tenth of that of bdpt on Cornell boxes",
      kGeneralKernels);
  const bool few = FewPrimitives::suits(scene);
  item("acceleration tree", !few,
       few ? text(scene.triangle_count() + scene.sphere_count()) +
                 " opaque primitive(s), all of which are tested"
           : "primitives are many, masked or in instances",
       "its traversal: more than the tests it saves");
  // Measured on closed meshes of 12 to 320,000 triangles, of extent 1 and 0.001; watertight_test.cc.
  item("robust traversal", !few,
       few ? "there is no tree"
           : "without it 2 of a million rays leave a closed mesh, and a sixth of those that aim at its edges",
       "a tenth to a fifth of the time in the tree");
  item("spheres", scene.sphere_count() > 0, text(scene.sphere_count()) + " sphere(s)",
       "the user geometry and its intersection code");
  item("light selection", scene.lights.count() > 1, text(scene.lights.count()) + " light(s)",
       "a random number and two look-ups per sample");
  const NextEventGuide& guide = scene.lights.guide;
  item("light tree", !scene.lights.tree.empty() && !guide.chooses(),
       guide.chooses() && !scene.lights.tree.empty()
           ? "a next-event guide chooses in its place"
           : (scene.lights.tree.empty() ? "not more than " : "more than ") + text(kAliasLights) +
                 " lights within the scene",
       "a traversal per light sample and per emitter that a path hits");
  const std::string gain = text(static_cast<int>(std::lround(100 * guide.gain - 100)));
  item("next-event guide", !guide.empty(),
       !guide.empty()
           ? "much of the lights is hidden: without it samples of them have " + gain + " % more mean square"
       : guide.gain == 1 ? "there is nothing to choose, or there are fibres, bodies or media that shine"
                         : "it would save " + gain + " % of the mean square of samples of lights",
       "a look-up per light sample and per light that a path meets");
  item("emission cells", !scene.lights.emission_cells.empty(),
       !scene.lights.emission_cells.empty() ? "little of a distant light gets to what is seen"
       : scene.lights.any_distant           ? "much of every distant light gets to what is seen"
                                            : "no distant light",
       "a table of where light paths start, and a look-up per weight of one");
  const std::string noise = text(static_cast<int>(std::lround(100 * scene.emission_guide_gain - 100)));
  item("guided emission", guided_emission,
       scene.emission_guide_gain == 1 ? "there are no light paths, or one place for them to go"
       : guided_emission              ? "light paths that went anywhere would make " + noise + " % more noise"
       : scene.guided_lights && !(strategies & kLightPaths)
           ? "the sampling plan has no light paths"
           : "light paths that go anywhere make " + noise + " % more noise" +
                 (plan_of(settings).guided_emission ? ", and cost so much less, by the pilot" : ""),
       "a look-up per light path and per weight of one, and longer paths");
  const double without = scene.caustics.gain;
  const std::string times = text(static_cast<int>(without)) +
                            (without < 10 ? "." + text(static_cast<int>(without * 10) % 10) : std::string());
  item("photon guide", !scene.caustics.empty(),
       !scene.caustics.empty()
           ? "light comes through glass or off mirrors: without it there would be about " + times +
                 " times the noise"
       : without > 1     ? "without it there is " + times + " times the noise, which is not worth it"
       : scene.any_delta ? "what comes through glass or off mirrors is little of the noise, or out of reach"
                         : "no smooth metal, glass or coat",
       "a look-up per scattering event and per weight of one, and longer paths");
  item("manifold next event", !scene.manifolds.empty(),
       !scene.manifolds.empty()
           ? "they bring about " + text(static_cast<int>(std::lround(100 * missing.walked))) +
                 " % of the image's light, which paths meet never, or seldom and as fireflies"
       : scene.any_delta ? "what they alone would bring is little, or they do not find it"
                         : "no smooth metal, glass or coat",
       "walks from where mirrors and glass are seen to lights, and a look-up per light that a path meets");
  item("delta lights", scene.lights.any_delta,
       scene.lights.any_delta ? "a light at a point or a distant one"
                              : "no light at a point and no distant one",
       "their cases in light sampling", kDeltaLights);
  const bool lamps = scene.lights.any_flat_lamp || scene.lights.any_facing;
  item("lamps", lamps,
       !lamps ? "no light has an area without a surface"
       : scene.lights.lamps.empty()
           ? "they are sampled alone, as there are media or panes: mirrors do not show them"
           : text(scene.lights.lamps.size()) + " that paths go through",
       "a look at each of them per segment of a camera path");
  item("kinds of rays", scene.hides != 0,
       scene.hides == 0 ? "nothing is hidden from some rays"
       : (scene.hides & kScatteredRays) != 0
           ? "something is hidden from rays by how they scatter, or from all but the camera's"
       : (scene.hides & kShadowRays) != 0 ? "something casts no shadow"
                                          : "something is hidden from the camera",
       "a callback per crossing of what is hidden, and a kind per ray");
  item("environment", !scene.lights.infinite.empty(),
       scene.lights.infinite.empty() ? "no infinite light" : "an infinite light",
       "the escape branch of camera paths");
  item("environment image", !scene.lights.environments.empty(),
       scene.lights.environments.empty() ? "no infinite light has one" : "an infinite light has one",
       "its memory, its sampling table and a random number per light sample");
  item("lights by images", scene.lights.any_imaged(),
       scene.lights.any_imaged() ? "a goniometric or projection light" : "no goniometric or projection light",
       "their images, and a random number per light path");
  item("patterned emitters", !scene.lights.patterns.empty(),
       scene.lights.patterns.empty() ? "every emitter is even and opaque"
                                     : text(scene.lights.patterns.size()) + " with a texture or an alpha",
       "a look-up per light sample, per light path and per emitter that a path hits");
  const auto strategy = [&](const char* feature, Strategies family, const char* saving) {
    const bool on = strategies & family;
    const std::string lost = shortest_path(paths_made(scene, settings.max_depth, family) &
                                           ~found_by(scene, settings.max_depth, strategies));
    item(feature, on,
         on ? chosen + " includes it"
         : !(possible & family)
             ? std::string("hair, what is hidden from some rays, or the camera does not allow it")
         : lost.empty() ? chosen + " leaves it out"
                        : chosen + " leaves it out, and light with it: " + lost,
         saving, family);
  };
  strategy("emission hits (s = 0)", kEmissionHits, "emission look-ups at hits and escapes");
  strategy("next-event estimation (s = 1)", kNextEvent, "light sampling and a shadow ray per camera vertex");
  strategy("vertex connections (s, t >= 2)", kVertexConnections,
           "the light-vertex cache and its shadow rays");
  strategy("light tracing (t = 1)", kLightTracing, "the splat layer and its traffic");
  const bool lens_radius = std::visit([](const auto& c) { return c.kHasLens; }, camera);
  item("lens sampling", lens_radius,
       lens_radius ? "the lens has a radius" : "the camera has no lens with a radius",
       "two dimensions per camera path and per light path that is joined to the lens");
  const std::string flattened =
      text(scene.flattened_instances) + " multiplied out, as used once, small, emitting or nearly singular";
  item("instances", scene.any_instances(),
       scene.any_instances()
           ? text(scene.instance_count()) + " instance(s) of " + text(scene.objects.size()) +
                 " object(s), which are built once" + (scene.flattened_instances ? "; " + flattened : "")
       : scene.flattened_instances ? flattened
                                   : "no object is instanced",
       "a level of traversal, and a transform per hit");
  item("motion blur", scene.moves(),
       !scene.moves() ? "nothing moves while the shutter is open"
       : scene.any_moving()
           ? text(scene.ways.size()) + " instance(s) or shape(s) move on " +
                 text(scene.poses.size() / kPoseFloats - scene.ways.size()) + " straight segment(s)" +
                 (scene.any_bending() ? ", " + text(scene.bends.size() - 1) + " of them mesh(es) that bend"
                                      : "") +
                 (scene.lights.any_moving() ? "; some light moves" : "") +
                 (scene.volumes.any_moving() ? "; some medium moves" : "") +
                 (scene.camera_motion.moves ? ", and so does the camera" : "")
           : "the camera moves",
       "a time per path, and a transform that is made anew for every ray that meets what moves");
  const size_t media = scene.medium_count();
  item("participating media", media > 0,
       media > 0
           ? text(media) + (scene.volumes.empty() ? " homogeneous, with " : ", some over a grid, with ") +
                 (scene.any_boundaries ? "boundaries" : "no boundary but surfaces")
           : "none in the scene",
       "distance sampling, the walk through boundaries and transmittance");
  item("media that vary", !scene.volumes.empty(), grids_in_words(scene.volumes),
       "tentative collisions against upper bounds, and a look-up of eight values for each");
  size_t shining = 0;
  for (const VolumeLight& light : scene.lights.volumes) shining += light.bricks.size();
  item("grids that shine", shining > 0,
       shining > 0 ? text(shining) + " bricks of them are sampled as lights" : "no grid shines",
       "a brick and a point in it per light sample, and a weight per tentative collision there");
  item("panes", scene.any_panes,
       scene.any_panes ? "thin smooth glass is looked through" : "no thin smooth glass in the scene",
       "the walk of paths and shadow rays through them");
  return plan;
}

}  // namespace lightmill
