#pragma once
// Pictures of jobs as HTTP answers; docs/dashboard.md describes them. All throw UnknownJob.
#include <httplib.h>

#include <string>

#include "coordinator/web/denoised/denoised_pictures.h"
#include "coordinator/web/light_mix/light_mixes.h"
#include "coordinator/web/pictures.h"
#include "coordinator/web/thumbnails/thumbnails.h"

namespace lightmill {

void answer_image(Pictures& pictures, const JobId& job, const httplib::Request& request,
                  httplib::Response& response);
void answer_error_map(Pictures& pictures, const JobId& job, httplib::Response& response);
void answer_denoised(DenoisedPictures& denoised, const JobId& job, const httplib::Request& request,
                     httplib::Response& response);
/// Throws Error(kUsage) for a mix that light_factors_of_text refuses.
void answer_light_mix(const Farm& farm, LightMixes& mixes, const JobId& job, const httplib::Request& request,
                      httplib::Response& response);
void answer_thumbnail(Thumbnails& thumbnails, const JobId& job, const httplib::Request& request,
                      httplib::Response& response);
/// Temporary files' names hold `name`.
void answer_png(Pictures& pictures, const JobId& job, const std::string& name,
                const httplib::Request& request, httplib::Response& response);
void answer_exr(const Farm& farm, const JobId& job, const std::string& name, httplib::Response& response);

}  // namespace lightmill
