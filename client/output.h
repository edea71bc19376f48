#pragma once
// Where an image goes and what its file records.
#include <map>
#include <string>

#include "client/options.h"
#include "common/error/report/report.h"
#include "common/image/image.h"
#include "common/scene/resolve_settings.h"
#include "coordinator/core/farm.h"

namespace lightmill::client {

/// Throws Error(kFailed) unless options.path can be written to, Error(kUsage) for an extension that can't be
/// written, or that can't hold what is asked for: --half, --colorspace and --aov are for .exr, views for
/// .png.
void check_output(const OutputOptions& options, Aovs aovs = 0);
/// Has `render` ask for no layers where the scene's film does and the file can't hold them.
void forget_film_layers(const OutputOptions& output, RenderOptions* render);
/// Whether the file's name ends in .exr, in any case: it can hold layers.
bool is_exr(const std::string& path);
/// Without --colorspace: an .exr that is made from image file `image` stays in its colour space.
void keep_image_space(const std::string& image, OutputOptions* output);
bool is_png(const std::string& path);

/// -o as given, or the scene's film filename in the current folder with the extension .exr. Checked by
/// check_output, so that a long render can't end in an error.
std::string output_path(const OutputOptions& options, const SceneDescription& scene, Aovs aovs);

/// What an image file says of its making: scene digest, settings, plan, build, spp, wall seconds, error.
std::map<std::string, std::string> image_metadata(const JobStatus& status);

/// What a report says of a job besides its curve and image.
ReportInfo report_info(const JobStatus& status, const std::optional<PilotReport>& pilot);

/// The crop window's size must be the reference's. Throws Error(kUsage), or Error(kFailed) if the file can't
/// be read. Empty for an empty path.
Image load_reference(const std::string& path, const FilmGrid& grid);

}  // namespace lightmill::client
