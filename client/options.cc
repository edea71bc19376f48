#include "client/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <regex>

#include "client/plan_file.h"
#include "client/terminal/terminal.h"
#include "common/base/error.h"
#include "common/build_id/build_id.h"
#include "common/rpc/security_flags.h"

namespace lightmill::client {
namespace {

template <class T>
T parse_number(const std::string& text, const std::string& option, const std::string& expected) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) {
    throw Error(ErrorKind::kUsage, option + " " + text + ": expected " + expected);
  }
  return value;
}

template <class T>
void add_ranged(CLI::App* verb, const std::string& name, std::optional<T>* target, T low, T high,
                const std::string& range, const std::string& help) {
  verb->add_option_function<std::string>(
      name,
      [=](const std::string& text) {
        const T value = parse_number<T>(text, name, range);
        bool inside = value >= low && value <= high;
        if constexpr (std::is_floating_point_v<T>) inside = inside && std::isfinite(value);
        if (!inside) throw Error(ErrorKind::kUsage, name + " " + text + ": expected " + range);
        *target = value;
      },
      help);
}

}  // namespace

void print_warning(const std::string& message) {
  // On a terminal a line of progress may stand there.
  std::fprintf(stderr, "%slightmill: %s\n", is_terminal(stderr) ? "\r\033[K" : "", message.c_str());
}

CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& description,
                   CommonOptions* common) {
  CLI::App* verb = app.add_subcommand(name, description);
  verb->set_version_flag("--version", build_id());
  verb->add_flag("--quiet,-q", common->quiet, "No progress and no warnings on stderr");
  return verb;
}

void add_json(CLI::App* verb, CommonOptions* common) {
  verb->add_flag("--json", common->json, "Print JSON on stdout");
}

void add_connection(CLI::App* verb, ConnectionOptions* connection) {
  verb->add_option("--coordinator", connection->coordinator,
                   "The coordinator's HOST:PORT; with standbys all of them, with commas between")
      ->envname("LIGHTMILL_COORDINATOR")
      ->capture_default_str();
  verb->add_flag("--insecure", connection->insecure, "Allow plain text to a coordinator on another machine")
      ->envname("LIGHTMILL_INSECURE");
  add_security_flags(*verb, &connection->security, Side::kClient);
}

/// An option of earlier versions, which still works and which --help does not show.
template <class T>
void add_older(CLI::App* verb, const char* option, std::function<void(const T&)> take) {
  verb->add_option_function<T>(option, std::move(take))->group("");
}

void add_unavailable(CLI::App* verb, const std::string& option, const std::string& what) {
  verb->add_option_function<std::string>(
          option,
          [=](const std::string&) {
            throw Error(ErrorKind::kUsage,
                        option + ": " + what + " does not exist in this version; leave the option out");
          },
          "Not available in this version: " + what)
      ->expected(0, 1)
      ->trigger_on_parse();
}

/// When a scene that is animated is shown.
void add_pose(CLI::App* verb, SceneOptions* scene) {
  constexpr double kLongest = 1e9;
  verb->add_option(
      "--animation", scene->pose.animation,
      "glTF: the animation of this name, or its number from 0; all; or none (default: the first, and "
      "those that move nothing that it moves)");
  add_ranged<double>(verb, "--time-of", &scene->pose.time, -kLongest, kLongest, "a number of seconds",
                     "glTF: the time in the animation, in seconds (default: as the file's nodes stand)");
  verb->add_option_function<std::string>(
      "--shutter",
      [scene](const std::string& text) {
        const std::string form = "OPEN,CLOSE, two numbers of frames such as -0.25,0.25";
        const size_t comma = text.find(',');
        if (comma == std::string::npos)
          throw Error(ErrorKind::kUsage, "--shutter " + text + ": expected " + form);
        const auto number = [&](const std::string& part) {
          const auto x = parse_number<double>(part, "--shutter", form);
          if (!(std::abs(x) <= kLongest))
            throw Error(ErrorKind::kUsage, "--shutter " + text + ": expected " + form);
          return x;
        };
        const double opens = number(text.substr(0, comma)), closes = number(text.substr(comma + 1));
        if (!(opens < closes)) {
          throw Error(ErrorKind::kUsage,
                      "--shutter " + text + ": it must close after it opens; expected " + form);
        }
        scene->shutter = {opens, closes};
      },
      "glTF: blur what moves from OPEN to CLOSE, in frames after --time-of, as 0,0.5");
  verb->add_option_function<std::string>(
          "--fps",
          [scene](const std::string& text) {
            const std::string form = "a number of frames a second above 0";
            scene->fps = parse_number<double>(text, "--fps", form);
            if (!(scene->fps >= 1e-6 && scene->fps <= 1e9))
              throw Error(ErrorKind::kUsage, "--fps " + text + ": expected " + form);
          },
          "Frames a second, for --shutter")
      ->default_str("24");
}

void add_scene(CLI::App* verb, SceneOptions* scene) {
  verb->add_option("SCENE", scene->scene, "A scene file: pbrt-v4 (.pbrt) or glTF 2.0 (.gltf, .glb)")
      ->required();
  verb->add_flag("--strict", scene->strict, "Warnings about the scene are errors");
  verb->add_flag("--missing-textures", scene->missing_textures,
                 "Render images that are not there as one grey");
  verb->add_flag("--strict-lights", scene->strict_lights,
                 "A scene without lights is black; without this it gets a white sky");
  verb->add_option_function<std::vector<std::string>>(
          "--map",
          [scene](const std::vector<std::string>& pairs) {
            for (const std::string& pair : pairs) {
              const size_t at = pair.find('=');
              if (at == std::string::npos || at == 0)
                throw CLI::ValidationError("--map", "needs FROM=TO, not \"" + pair + "\"");
              scene->map.emplace_back(pair.substr(0, at), pair.substr(at + 1));
            }
          },
          "Files whose names begin with FROM are taken from TO, as FROM=TO; may be given again")
      ->take_all()
      ->allow_extra_args(false);
  verb->add_option("--camera", scene->camera,
                   "glTF: the camera or node of this name, or its number from 0 (default: the first camera)");
  verb->add_option("--environment", scene->environment,
                   "glTF: light from all around by this lat-long picture (.exr, .hdr, ...)");
  add_pose(verb, scene);
}

void add_stop_rule(CLI::App* verb, SceneOptions* scene) {
  RenderOptions& render = scene->render;
  constexpr double kNoLimit = std::numeric_limits<double>::max();
  add_ranged<int64_t>(verb, "--spp", &render.spp, 1, int64_t{1} << 40,
                      "a whole number of samples, at least 1", "Samples per pixel");
  add_ranged<double>(verb, "--time", &render.time_s, 1e-3, kNoLimit, "a number of seconds above 0",
                     "Stop after so many seconds of rendering");
  verb->add_option_function<std::string>(
      "--target-error",
      [&render](const std::string& text) {
        const std::string range = "a relMSE above 0, or denoised: and one", prefix = "denoised:";
        render.target_denoised = text.starts_with(prefix);
        const auto value = parse_number<double>(render.target_denoised ? text.substr(prefix.size()) : text,
                                                "--target-error", range);
        if (!(value >= 1e-30) || !std::isfinite(value))
          throw Error(ErrorKind::kUsage, "--target-error " + text + ": expected " + range);
        render.target_error = value;
      },
      "Stop when the relMSE is below this, by the upper end of its 95 % interval; denoised:E: when that of "
      "the "
      "denoised image is");
}

void add_render_options(CLI::App* verb, SceneOptions* scene) {
  RenderOptions& render = scene->render;
  verb->add_option("--integrator", render.integrator,
                   "auto, bdpt, pt, lt, or scene: the one that the file names")
      ->check(CLI::IsMember({"auto", "bdpt", "pt", "lt", "scene"}))
      ->capture_default_str();
  verb->add_option(
      "--strategies", render.strategies,
      "Only these of the integrator's path strategies: hit,next-event,light-tracing,vertex-connection");
  verb->add_option("--light-paths", render.light_paths,
                   "Light paths per camera path: 0.125, 0.25, 0.5, 1 or 2 (bdpt: 1)");
  verb->add_option("--connections", render.connections,
                   "Light paths that a camera vertex is connected to: 0.25, 0.5, 1, 2, 4 or 8 (bdpt: 1)");
  verb->add_option("--light-tracing-weight,--lens-weight", render.light_tracing_weight,
                   "What light tracing counts for beside other strategies: 0.125, 1 or 3");
  verb->add_option(
      "--rr-depth", render.rr_depth,
      "First scattering event of camera paths at which Russian roulette is played: 2 or 3 (bdpt: 2)");
  verb->add_flag("--uniform-sampling", render.uniform_sampling,
                 "auto takes as many samples in every pixel, not more where it is noisy");
  add_older<std::string>(verb, "--effort", [&render](const std::string& how) {
    if (how != "adaptive" && how != "uniform") {
      throw Error(ErrorKind::kUsage, "--effort " + how +
                                         ": expected adaptive or uniform; the option is now "
                                         "called --uniform-sampling");
    }
    render.uniform_sampling = how == "uniform";
  });
  verb->add_flag("--energy-compensation", render.energy_compensation,
                 "Rough metals get back the light that single bounces between facets lose (pbrt's do not)");
  add_stop_rule(verb, scene);
  verb->add_option("--max-depth", scene->max_depth, "Scattering events per path, or \"unlimited\"");
  add_ranged<uint64_t>(verb, "--seed", &render.seed, 0, std::numeric_limits<uint64_t>::max(),
                       "a whole number from 0", "Seed of the random numbers");
  verb->add_option("--resolution", scene->resolution, "Image size in pixels: WxH");
  verb->add_option("--crop", scene->crop, "Crop window in [0,1]: x0,x1,y0,y1");
  // Spaces, so that manual pages can break the line.
  const std::string aovs = std::regex_replace(aov_names(kAllAovs), std::regex(","), ", ");
  verb->add_option(
      "--aov", render.aovs,
      "Also record, as layers of the .exr: a list of " + aovs + ", denoise, cryptomatte, or all");
  verb->add_option(
      "--plan", scene->plan,
      "How to sample, instead of the integrator's choice: a plan.json, job --json or an .exr image");
  verb->add_option(
      "--plan-override", render.overrides,
      "Keep features that the scene plan would leave out (see explain): a list, as textures,light-tracing");
  add_unavailable(verb, "--mixed", "rendering on several arithmetic classes");
}

void finish_scene_options(SceneOptions* scene) {
  RenderOptions& render = scene->render;
  if (scene->max_depth == "unlimited") {
    render.max_depth = kUnlimitedDepth;
  } else if (!scene->max_depth.empty()) {
    const std::string range = "a whole number of scattering events from 0, or \"unlimited\"";
    const int depth = parse_number<int>(scene->max_depth, "--max-depth", range);
    if (depth < 0) throw Error(ErrorKind::kUsage, "--max-depth " + scene->max_depth + ": expected " + range);
    render.max_depth = std::min(depth, kUnlimitedDepth);
  }
  if (!scene->resolution.empty()) {
    const std::string& text = scene->resolution;
    const size_t cross = text.find('x');
    const std::string form = "WxH, two whole numbers of pixels such as 640x480";
    if (cross == std::string::npos)
      throw Error(ErrorKind::kUsage, "--resolution " + text + ": expected " + form);
    render.width = parse_number<int>(text.substr(0, cross), "--resolution", form);
    render.height = parse_number<int>(text.substr(cross + 1), "--resolution", form);
    if (*render.width < 1 || *render.height < 1) {
      throw Error(ErrorKind::kUsage, "--resolution " + text + ": both sides must be at least 1 pixel");
    }
  }
  if (!scene->plan.empty()) render.plan = read_plan(scene->plan);
  if (!scene->crop.empty()) {
    const std::string form = "x0,x1,y0,y1 with 0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1";
    std::array<double, 4> window{};
    size_t begin = 0;
    for (size_t i = 0; i < 4; ++i) {
      const size_t comma = scene->crop.find(',', begin);
      if ((comma == std::string::npos) != (i == 3)) {
        throw Error(ErrorKind::kUsage, "--crop " + scene->crop + ": expected " + form);
      }
      window[i] = parse_number<double>(scene->crop.substr(begin, comma - begin), "--crop", form);
      begin = comma + 1;
    }
    const bool valid = window[0] >= 0 && window[0] < window[1] && window[1] <= 1 && window[2] >= 0 &&
                       window[2] < window[3] && window[3] <= 1;
    if (!valid) throw Error(ErrorKind::kUsage, "--crop " + scene->crop + ": expected " + form);
    render.crop = window;
  }
}

void add_display(CLI::App* verb, std::string* display) {
  verb->add_option("--display", *display, "Show the picture as it grows in the viewer tev at HOST:PORT");
}

LoadOptions load_options(const SceneOptions& options) {
  LoadOptions load;
  load.strict = options.strict;
  load.camera = options.camera;
  load.environment = options.environment;
  load.missing_textures = options.missing_textures;
  load.strict_lights = options.strict_lights;
  load.pose = options.pose;
  if (options.shutter) {
    load.pose.opens = (*options.shutter)[0] / options.fps;
    load.pose.closes = (*options.shutter)[1] / options.fps;
  }
  if (!load.environment.empty()) load.environment = std::filesystem::absolute(load.environment).string();
  return load;
}

SceneDescription load_scene_for(const SceneOptions& options, bool quiet) {
  return load_scene_file(
      options.scene, load_options(options),
      [quiet](const Problem& problem) {
        if (!quiet) print_warning(format_problem(problem));
      },
      options.map);
}

}  // namespace lightmill::client
