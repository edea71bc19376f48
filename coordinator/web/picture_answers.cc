#include "coordinator/web/picture_answers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "common/base/error.h"
#include "coordinator/web/answers.h"
#include "coordinator/web/light_mix/mix_text.h"

namespace lightmill {
namespace {

using httplib::Request;
using httplib::Response;

constexpr double kMostStops = 100;  // of exposure
constexpr char kBytes[] = "application/octet-stream";

/// The parameters "view" and "exposure", as the options of these names in lightmill fetch.
ViewTransform view_of(const Request& request) {
  ViewTransform view;
  if (request.has_param("view")) view.curve = view_curve_named(request.get_param_value("view"));
  if (request.has_param("exposure")) {
    const std::string text = request.get_param_value("exposure");
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), view.exposure);
    if (error != std::errc() || end != text.data() + text.size() || !(std::abs(view.exposure) <= kMostStops))
      throw Error(ErrorKind::kUsage, "exposure must be a number from -100 to 100");
  }
  return view;
}

/// A browser that wants the newest one asks again.
void mark_stale(bool current, Response& response) {
  if (!current) response.set_header("X-Lightmill-Stale", "1");
}

std::shared_ptr<const Image> image_of(Pictures& pictures, const JobId& job, Pictures::Kind kind,
                                      Response& response) {
  const Pictures::Picture picture = pictures.get(job, kind);
  response.set_header("Cache-Control", "no-store");
  mark_stale(picture.current, response);
  return picture.image;
}

/// The longer side that the picture is to have; 0: its own.
int side_of(const Request& request) {
  return static_cast<int>(std::min<int64_t>(whole(request, "side", 0), kMaxResolution));
}

void answer_halves(const Image& image, const Request& request, Response& response) {
  const int side = side_of(request);
  const bool whole_size = side == 0 || side >= std::max(image.width, image.height);
  response.set_content(half_picture(whole_size ? image : reduced(image, side)), kBytes);
}

/// True, and the answer is complete, if the browser has it already.
bool has_already(const std::string& mark, const Request& request, Response& response) {
  const std::string tag = "\"" + mark + "\"";
  response.set_header("ETag", tag);
  if (request.get_header_value("If-None-Match") != tag) return false;
  response.status = 304;
  return true;
}

void attach(const JobId& job, const char* extension, Response& response) {
  response.set_header("Content-Disposition", "attachment; filename=\"" + job.value + extension + "\"");
}

std::string figure_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace

void answer_image(Pictures& pictures, const JobId& job, const Request& request, Response& response) {
  answer_halves(*image_of(pictures, job, Pictures::Kind::kBeauty, response), request, response);
}

void answer_error_map(Pictures& pictures, const JobId& job, Response& response) {
  response.set_content(float_picture(*image_of(pictures, job, Pictures::Kind::kError, response)), kBytes);
}

void answer_denoised(DenoisedPictures& denoised, const JobId& job, const Request& request,
                     Response& response) {
  const std::optional<DenoisedPictures::Answer> found = denoised.get(job);
  response.set_header("Cache-Control", "no-store");
  if (!found) {
    response.status = 204;
    return;
  }
  mark_stale(found->current, response);
  const DenoisedPicture& picture = found->picture;
  response.set_header("X-Lightmill-Relmse", figure_text(picture.relmse));
  response.set_header("X-Lightmill-Relmse-Raw", figure_text(picture.relmse_raw));
  if (!picture.layers.empty()) response.set_header("X-Lightmill-Layers", picture.layers);
  response.set_header("X-Lightmill-Block", std::to_string(picture.block));
  if (!has_already(found->mark, request, response)) answer_halves(*picture.image, request, response);
}

void answer_light_mix(const Farm& farm, LightMixes& mixes, const JobId& job, const Request& request,
                      Response& response) {
  if (request.get_param_value_count("mix") > 1) throw Error(ErrorKind::kUsage, "give mix once");
  const std::string mix = request.get_param_value("mix");
  const JobStatus status = farm.job(job);
  const std::vector<LightFactor> factors = light_factors_of_text(mix, status.settings.light_groups);
  const int side = side_of(request);
  const std::optional<LightMixes::Answer> found = mixes.get(status);
  response.set_header("Cache-Control", "no-store");
  if (!found) {
    response.status = 204;
    return;
  }
  mark_stale(found->current, response);
  const MixedLight& light = *found->light;
  response.set_header("X-Lightmill-Block", std::to_string(light.block));
  // Nothing that was taken for a mix needs quotes.
  const std::string tag = light.mark + "-" + std::to_string(side) + "-" + mix;
  if (!has_already(tag, request, response))
    answer_halves(mixed_image(light, factors, side), request, response);
}

void answer_thumbnail(Thumbnails& thumbnails, const JobId& job, const Request& request, Response& response) {
  const std::optional<Thumbnails::Answer> found = thumbnails.get(job);
  response.set_header("Cache-Control", "no-cache");  // ask, as the job may have got on
  if (!found) {
    response.status = 204;
    return;
  }
  mark_stale(found->current, response);
  if (!has_already(found->thumbnail.mark, request, response))
    response.set_content(*found->thumbnail.png, "image/png");
}

void answer_png(Pictures& pictures, const JobId& job, const std::string& name, const Request& request,
                Response& response) {
  const auto image = image_of(pictures, job, Pictures::Kind::kBeauty, response);
  attach(job, ".png", response);
  response.set_content(png_file(*image, view_of(request), name), "image/png");
}

void answer_exr(const Farm& farm, const JobId& job, const std::string& name, Response& response) {
  const std::string bytes = exr_file(farm, job, name);
  response.set_header("Cache-Control", "no-store");
  attach(job, ".exr", response);
  response.set_content(bytes, "image/x-exr");
}

}  // namespace lightmill
