#pragma once
// What the bench programs share: a scene from the command line, built for rendering, and its packets.
#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "common/scene/resolve_settings.h"
#include "worker/render/renderer.h"

namespace lightmill::bench {

struct Options {
  std::string scene, resolution;
  RenderOptions render;
  int64_t spp = 16;
  int threads = 0;
};

/// SCENE, --integrator, --spp, --resolution, --threads, --plan-override.
void add_options(CLI::App& app, Options* options);

/// Throws Error for a resolution that isn't one.
RenderOptions render_options(const Options& options);

struct Scene {
  double load_s = 0, build_s = 0, pilot_s = 0;  // reading; textures, arrays and tree; choosing the plan
  std::unique_ptr<Renderer> renderer;
  RenderSettings settings;

  double samples() const;
  std::vector<Packet> packets() const;  // of the crop window, all samples
  PartialBuilder builder() const;
};

/// Throws Error for a scene or options that are wrong.
Scene build(const Options& options);

/// Wall seconds of a call.
template <class Work>
double seconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Parses the command line, runs `work` and gives its exit code; errors go to stderr in one line.
int run_main(CLI::App& app, int argc, char** argv, const std::function<void()>& work);

}  // namespace lightmill::bench
