#include "coordinator/web/job_follower.h"

#include <nlohmann/json.hpp>

#include "coordinator/web/json_views.h"

namespace lightmill {
namespace {

std::string event(const nlohmann::json& data) { return "event: job\ndata: " + json_text(data) + "\n\n"; }

constexpr double kPointSpacing = 1.1;  // points of the curve are farther apart in spp

}  // namespace

std::string JobFollower::next() {
  nlohmann::json data = {{"id", job_.value}, {"full", !begun_}};
  JobStatus status;
  try {
    status = farm_.job(job_);
  } catch (const UnknownJob&) {
    if (std::exchange(missing_, true)) return {};
    data["missing"] = true;
    return event(data);
  }
  if (begun_ && status.version == version_) return {};
  version_ = status.version;
  if (frame_of(job_)) data["row"] = job_view(status);  // the rows of all jobs lack it

  nlohmann::json view = job_detail_view(status, farm_.pilot(job_));
  view.erase("camera_paths");  // these change all the time; the row tells of progress
  view.erase("light_paths");
  view.erase("tiles_committed");
  if (std::string text = json_text(view); text != detail_) {
    detail_ = std::move(text);
    data["detail"] = std::move(view);
  }

  if (status.denoised_relmse != denoised_mark_) {  // of a point that was told without it
    denoised_mark_ = status.denoised_relmse;
    points_ = 0;
    curve_mark_ = {};
  }
  const auto& [relmse, spp, state] = curve_mark_;
  if (!begun_ || status.relmse.value_or(0) != relmse || status.spp >= kPointSpacing * spp ||
      status.state != state) {
    curve_mark_ = {status.relmse.value_or(0), status.spp, status.state};
    const ErrorCurve curve = farm_.curve(job_);
    // Points go when samples are taken back; then the curve is told anew.
    if (curve.points.size() < points_) points_ = 0;
    if (curve.points.size() > points_ || points_ == 0) {
      data["points"] = curve_view(curve, points_);
      data["points_from"] = points_;
    }
    points_ = curve.points.size();
  }

  const TileMap map = farm_.tile_map(job_);
  auto tiles = nlohmann::json::array();
  std::map<int64_t, std::string> sent;
  for (const TileStatus& tile : map.tiles) {
    nlohmann::json row = tile_view(tile);
    std::string text = row.dump();
    const auto before = tiles_.find(tile.id.value);
    if (before == tiles_.end() || before->second != text) {
      if (const auto lease = map.leased_seconds.find(tile.id); lease != map.leased_seconds.end())
        row["leased_seconds"] = lease->second;
      tiles.push_back(std::move(row));
    }
    sent.emplace(tile.id.value, std::move(text));
  }
  if (!tiles.empty()) data["tiles"] = std::move(tiles);
  if (!sent.empty()) data["first_tile"] = sent.begin()->first;
  data["complete_samples"] = map.complete_samples;
  tiles_ = std::move(sent);
  begun_ = true;
  return event(data);
}

}  // namespace lightmill
