#include "coordinator/core/job_results.h"

#include <cstdio>
#include <memory>
#include <utility>

#include "common/error/box_figures.h"
#include "common/image/enlarge.h"

namespace lightmill {
namespace {

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace

Image JobResults::image(const JobId& id) const {
  const Merger::Open layers = storage_.open_layers(id);
  return layers->film.resolve();
}

Image JobResults::display_image(const JobId& id) const {
  std::shared_ptr<const Image> look;
  PixelRect crop;
  {
    const std::lock_guard lock(farm_.mutex);
    const JobRecord& record = jobs_.get(id).record;
    crop = record.settings.grid.crop;
    if (record.packets_done == 0) look = farm_.first_looks.find(id);
  }
  if (look) return enlarged(*look, crop.width(), crop.height());
  const Merger::Open layers = storage_.open_layers(id);
  return layers->film.resolve_for_display();
}

ChannelImage JobResults::aovs(const JobId& id, Image* image, bool for_display) const {
  const Merger::Open layers = storage_.open_layers(id);
  if (image) *image = for_display ? layers->film.resolve_for_display() : layers->film.resolve();
  return layers->film.resolve_aovs();
}

ChannelImage JobResults::light_groups(const JobId& id, int block) const {
  return storage_.open_layers(id)->film.light_groups_for_display(block);
}

Image JobResults::error_map(const JobId& id) const {
  const Merger::Open layers = storage_.open_layers(id);
  return layers->batches.error_map(layers->batches.error_map_block());
}

ErrorCurve JobResults::curve(const JobId& id) const {
  const std::lock_guard lock(farm_.mutex);
  return {jobs_.get(id).record.name, newest_points(farm_.store->curve(id))};
}

std::optional<PilotReport> JobResults::pilot(const JobId& id) const {
  {
    const std::lock_guard lock(farm_.mutex);
    jobs_.get(id);  // throws for an unknown one
  }
  const std::string report = farm_.store->pilot(id);
  if (report.empty()) return std::nullopt;
  return pilot_from_json(report);
}

std::map<std::string, std::string> JobResults::image_metadata(const JobId& id) const {
  const std::lock_guard lock(farm_.mutex);
  const Job& job = jobs_.get(id);
  const JobStatus s = view_.status(job, farm_.clock.now());
  std::map<std::string, std::string> metadata = {{"job", s.id.value},
                                                 {"name", s.name},
                                                 {"state", job_state_name(s.state)},
                                                 {"scene", s.bundle_digest},
                                                 {"settings", settings_to_json(s.settings)},
                                                 {"integrator", integrator_name(s.settings.integrator)},
                                                 {"spp", std::to_string(s.spp)},
                                                 {"wall_seconds", std::to_string(s.wall_seconds)},
                                                 {"cpu_seconds", std::to_string(s.cpu_seconds)},
                                                 {"nonfinite", std::to_string(s.counters.nonfinite)},
                                                 {"arithmetic_class", job.record.arithmetic_class},
                                                 {"build", farm_.options.build}};
  if (!needs_pilot(s.settings)) metadata["plan"] = plan_to_json(plan_of(s.settings));
  for (const auto& [key, value] :
       {std::pair{"relmse", s.relmse}, {"relmse_low", s.relmse_low}, {"relmse_high", s.relmse_high}}) {
    if (value) metadata[key] = number_text(*value);
  }
  for (const BoxFigure& figure : box_estimates()) {
    if (figure.of(s.boxes)) metadata[figure.name] = number_text(*figure.of(s.boxes));
  }
  return metadata;
}

}  // namespace lightmill
