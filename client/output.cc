#include "client/output.h"

#include <cstdio>
#include <filesystem>

#include "common/base/error.h"
#include "common/base/lower_case.h"
#include "common/build_id/build_id.h"
#include "common/error/box_figures.h"
#include "common/error/metrics.h"
#include "common/image/image.h"

namespace lightmill::client {

namespace {

std::string extension_of(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

}  // namespace

bool is_exr(const std::string& path) { return extension_of(path) == ".exr"; }
bool is_png(const std::string& path) { return extension_of(path) == ".png"; }

void keep_image_space(const std::string& image, OutputOptions* output) {
  if (output->colorspace.empty() && is_exr(output->path))
    output->space = read_image_space(image).value_or(ImageSpace::kRec709);
}

void forget_film_layers(const OutputOptions& output, RenderOptions* render) {
  if (!render->aovs && !output.path.empty() && !is_exr(output.path)) render->aovs = "";
}

void check_output(const OutputOptions& options, Aovs aovs) {
  const std::string& path = options.path;
  if (options.half && !is_exr(path)) {
    throw Error(ErrorKind::kUsage, "--half: only .exr files hold 16-bit floats, not " + path);
  }
  // What denoising goes by need not be kept.
  if (options.denoise) aovs &= ~kAovsToDenoise;
  if (aovs && !is_exr(path)) {
    throw Error(ErrorKind::kUsage, "--aov: only .exr files hold layers, not " + path);
  }
  if (options.space != ImageSpace::kRec709 && !is_exr(path)) {
    throw Error(ErrorKind::kUsage,
                "--colorspace: only .exr files say which theirs is; " + path + " is Rec.709");
  }
  if (options.transform != ViewTransform{} && !is_png(path)) {
    throw Error(ErrorKind::kUsage,
                "--view and --exposure: they are for .png; " + path + " keeps linear values");
  }
  check_writable(path);
}

std::string output_path(const OutputOptions& options, const SceneDescription& scene, Aovs aovs) {
  OutputOptions output = options;
  if (output.path.empty()) {
    std::string stem = std::filesystem::path(scene.film.filename).stem().string();
    if (stem.empty()) stem = "lightmill";
    output.path = stem + ".exr";
  }
  check_output(output, aovs);
  return output.path;
}

std::map<std::string, std::string> image_metadata(const JobStatus& status) {
  const auto number = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    return std::string(text);
  };
  std::map<std::string, std::string> metadata = {{"scene", status.bundle_digest},
                                                 {"settings", settings_to_json(status.settings)},
                                                 {"integrator", integrator_name(status.settings.integrator)},
                                                 {"build", build_id()},
                                                 {"spp", number(status.spp)},
                                                 {"wall_seconds", number(status.wall_seconds)},
                                                 {"cpu_seconds", number(status.cpu_seconds)},
                                                 {"nonfinite", std::to_string(status.counters.nonfinite)},
                                                 {"job", status.name}};
  if (!needs_pilot(status.settings)) metadata["plan"] = plan_to_json(plan_of(status.settings));
  if (status.relmse) metadata["relmse"] = number(*status.relmse);
  if (status.relmse_low) metadata["relmse_low"] = number(*status.relmse_low);
  if (status.relmse_high) metadata["relmse_high"] = number(*status.relmse_high);
  for (const BoxFigure& figure : box_estimates()) {
    if (figure.of(status.boxes)) metadata[figure.name] = number(*figure.of(status.boxes));
  }
  return metadata;
}

ReportInfo report_info(const JobStatus& status, const std::optional<PilotReport>& pilot) {
  ReportInfo info{
      status.name,   settings_to_json(status.settings), status.counters, "", pilot, status.missing_light,
      status.dropped};
  if (!needs_pilot(status.settings))
    info.plan_json = pilot ? pilot_to_json(*pilot) : plan_to_json(plan_of(status.settings));
  return info;
}

Image load_reference(const std::string& path, const FilmGrid& grid) {
  if (path.empty()) return {};
  Image image = read_image(path);
  if (image.width != grid.crop.width() || image.height != grid.crop.height()) {
    throw Error(ErrorKind::kUsage, path + ": the reference has " + std::to_string(image.width) + "x" +
                                       std::to_string(image.height) + " pixels and the image " +
                                       std::to_string(grid.crop.width()) + "x" +
                                       std::to_string(grid.crop.height()) + "; give one of the same size");
  }
  try {
    check_comparable(image, "reference");
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, path + ": " + e.what());
  }
  return image;
}

}  // namespace lightmill::client
