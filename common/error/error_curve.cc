#include "common/error/error_curve.h"

#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/error.h"
#include "common/error/box_figures.h"

namespace lightmill {

namespace {

using Json = nlohmann::json;

Json optional_json(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

std::optional<double> optional_number(const Json& point, const std::string& key) {
  const auto it = point.find(key);
  if (it == point.end() || it->is_null()) return std::nullopt;
  return it->get<double>();
}

}  // namespace

std::vector<ErrorPoint> newest_points(std::vector<ErrorPoint> stored) {
  std::vector<ErrorPoint> points;
  std::map<double, size_t> at;
  for (ErrorPoint& point : stored) {
    const auto [place, is_new] = at.emplace(point.spp, points.size());
    if (is_new) {
      points.push_back(std::move(point));
    } else {
      points[place->second] = std::move(point);
    }
  }
  return points;
}

std::string curve_to_json(const ErrorCurve& curve) {
  Json points = Json::array();
  for (const ErrorPoint& p : curve.points) {
    points.push_back({{"wall_seconds", p.wall_seconds},
                      {"cpu_seconds", p.cpu_seconds},
                      {"spp", p.spp},
                      {"relmse", optional_json(p.relmse)},
                      {"relmse_low", optional_json(p.relmse_low)},
                      {"relmse_high", optional_json(p.relmse_high)},
                      {"batches", p.batches},
                      {"true_relmse", optional_json(p.true_relmse)},
                      {"true_relmse_trimmed", optional_json(p.true_relmse_trimmed)},
                      {"true_flip", optional_json(p.true_flip)},
                      {"denoised_relmse", optional_json(p.denoised_relmse)},
                      {"denoised_relmse_low", optional_json(p.denoised_relmse_low)},
                      {"denoised_relmse_high", optional_json(p.denoised_relmse_high)}});
    for (const BoxFigure& figure : box_figures())
      points.back()[figure.name] = optional_json(figure.of(p.boxes));
  }
  const Json json = {{"job_name", curve.job_name}, {"points", points}};
  // A name that is not UTF-8 shows as replacement characters; it must not lose the curve.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

ErrorCurve curve_from_json(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    ErrorCurve curve;
    curve.job_name = json.at("job_name").get<std::string>();
    for (const Json& point : json.at("points")) {
      ErrorPoint p;
      p.wall_seconds = point.at("wall_seconds").get<double>();
      p.cpu_seconds = point.at("cpu_seconds").get<double>();
      p.spp = point.at("spp").get<double>();
      p.batches = point.at("batches").get<int>();
      p.relmse = optional_number(point, "relmse");
      p.relmse_low = optional_number(point, "relmse_low");
      p.relmse_high = optional_number(point, "relmse_high");
      p.true_relmse = optional_number(point, "true_relmse");
      p.true_relmse_trimmed = optional_number(point, "true_relmse_trimmed");
      p.true_flip = optional_number(point, "true_flip");
      p.denoised_relmse = optional_number(point, "denoised_relmse");
      p.denoised_relmse_low = optional_number(point, "denoised_relmse_low");
      p.denoised_relmse_high = optional_number(point, "denoised_relmse_high");
      for (const BoxFigure& figure : box_figures()) figure.of(p.boxes) = optional_number(point, figure.name);
      curve.points.push_back(p);
    }
    return curve;
  } catch (const Json::exception& e) {
    throw Error(ErrorKind::kFailed, std::string("the error curve is malformed: ") + e.what());
  }
}

}  // namespace lightmill
