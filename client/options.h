#pragma once
// Option groups that several verbs share.
#include <array>
#include <memory>
#include <optional>
#include <string>

#include "common/image/image_space.h"
#include "common/image/view_transform.h"
#include "common/rpc/security.h"
#include "common/scene/load.h"
#include "common/scene/resolve_settings.h"

namespace CLI {
class App;
}

namespace lightmill::client {

/// --quiet, and --json where the verb prints data.
struct CommonOptions {
  bool quiet = false;
  bool json = false;
};

/// Adds a verb with --help, --version and --quiet. Every verb starts with this.
CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& description,
                   CommonOptions* common);
void add_json(CLI::App* verb, CommonOptions* common);

/// --coordinator, --credentials and the options of TLS and tokens; the default is $LIGHTMILL_COORDINATOR,
/// then localhost:7070.
struct ConnectionOptions {
  std::string coordinator = "localhost:7070";
  bool insecure = false;     // allow plain text to another machine
  SecurityFiles security{};  // as given
};
void add_connection(CLI::App* verb, ConnectionOptions* connection);

/// What to render and how: the scene, and the options that override its settings (docs/render-options.md).
struct SceneOptions {
  std::string scene;
  bool strict = false;
  std::string camera, environment;  // for glTF, see LoadOptions
  bool missing_textures = false, strict_lights = false;
  PoseChoice pose;  // but for its shutter, which is in frames:
  std::optional<std::array<double, 2>> shutter;
  double fps = 24;
  PathMap map;
  RenderOptions render;
  // As typed; `finish_scene_options` turns them into `render`.
  std::string max_depth, resolution, crop, plan;
};
void add_scene(CLI::App* verb, SceneOptions* scene);
void add_render_options(CLI::App* verb, SceneOptions* scene);
/// --spp, --time and --target-error alone (also part of the render options).
void add_stop_rule(CLI::App* verb, SceneOptions* scene);
/// Parses what CLI11 took as text and reads the file of --plan. Throws Error(kUsage), or Error(kFailed) if
/// that file can't be read.
void finish_scene_options(SceneOptions* scene);

/// -o, and how its file is written.
struct OutputOptions {
  std::string path;
  bool half = false;
  double exposure = 0;
  bool denoise = false;
  // As typed; `finish_output_options` turns them into what follows.
  std::optional<std::string> view;
  std::string ocio, colorspace;
  ViewTransform transform{};               // of a .png
  ImageSpace space = ImageSpace::kRec709;  // of an .exr
};
void add_output(CLI::App* verb, OutputOptions* output);
/// Looks up the view, in the configuration of --ocio or $OCIO if there is one, and the colour space. Throws
/// Error(kUsage) for one that is not there, or Error(kFailed) if the configuration can't be used.
void finish_output_options(OutputOptions* output);
/// --denoise, of verbs that write what was rendered.
void add_denoise_flag(CLI::App* verb, OutputOptions* output);

/// --display: see live_view.h.
void add_display(CLI::App* verb, std::string* display);

/// An option that is planned but does not exist yet: it is refused in one line, never ignored.
void add_unavailable(CLI::App* verb, const std::string& option, const std::string& what);

/// What the options say to the scene's reader; the environment's path made absolute, as it is relative to the
/// working folder and not to the scene's.
LoadOptions load_options(const SceneOptions& options);
/// Loads a scene from disk. Unsupported features are warned of on stderr unless `quiet`. Throws
/// Error(kBadScene) with the first problem.
SceneDescription load_scene_for(const SceneOptions& options, bool quiet);

/// "NAME: message" to stderr, on one line.
void print_warning(const std::string& message);

}  // namespace lightmill::client
