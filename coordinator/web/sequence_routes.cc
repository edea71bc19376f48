#include "coordinator/web/sequence_routes.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/base/error.h"
#include "coordinator/web/actions.h"
#include "coordinator/web/answers.h"
#include "coordinator/web/json_views.h"

namespace lightmill {
namespace {

using nlohmann::json;

constexpr std::string_view kSequences = "/api/v1/sequences";
constexpr size_t kMaxSequencesOfAnswer = 100, kMaxFramesOfAnswer = 1000;
constexpr size_t kFramesOfLock = 200;  // others get at the farm in between

void put_error(json* row, const char* key, const std::optional<double>& value) {
  if (value) (*row)[key] = json_number(*value);
}

json sequence_view(const SequenceStatus& s) {
  const SequenceRequest& request = s.request;
  json row = {{"id", s.id.value},
              {"version", s.version},
              {"name", request.name},
              {"state", job_state_name(s.state)},
              {"priority", request.priority},
              {"order", frame_order_name(request.order)},
              {"fps", json_number(request.fps)},
              {"frame_count", s.frame_count},
              {"first_frame", s.first_frame},
              {"last_frame", s.last_frame},
              {"packets_done", s.packets_done},
              {"packets_total", s.packets_total},
              {"wall_seconds", json_number(s.wall_seconds)},
              {"cpu_seconds", json_number(s.cpu_seconds)},
              {"rate", json_number(s.samples_per_second)},
              {"eta_seconds", json_number(s.eta_seconds)},
              {"workers", s.workers}};
  json& frames = row["frames"] = json::object();
  for (size_t i = 0; i < std::size(s.frames); ++i)
    frames[job_state_name(static_cast<JobState>(i))] = s.frames[i];
  if (!s.message.empty()) row["message"] = s.message;
  if (!request.pool.empty()) row["pool"] = request.pool;
  if (!request.submitter.empty()) row["submitter"] = request.submitter;
  if (request.max_workers > 0) row["max_workers"] = request.max_workers;
  if (request.budget_seconds > 0) row["budget_seconds"] = json_number(request.budget_seconds);
  if (request.deadline > 0) row["deadline"] = request.deadline;
  for (const JobId& id : request.after) row["after"].push_back(id.value);
  put_error(&row, "relmse_mean", s.relmse_mean);
  put_error(&row, "relmse_max", s.relmse_max);
  return row;
}

json frame_view(const FrameStatus& f) {
  json row = {{"number", f.number},
              {"id", f.job.value},
              {"version", f.version},
              {"state", job_state_name(f.state)},
              {"spp", json_number(f.spp)},
              {"packets_done", f.packets_done},
              {"packets_total", f.packets_total},
              {"wall_seconds", json_number(f.wall_seconds)},
              {"cpu_seconds", json_number(f.cpu_seconds)}};
  if (!f.message.empty()) row["message"] = f.message;
  put_error(&row, "relmse", f.relmse);
  put_error(&row, "relmse_low", f.relmse_low);
  put_error(&row, "relmse_high", f.relmse_high);
  return row;
}

/// The parameter "after": a frame's number, which may be negative.
std::optional<int> frame_after(const httplib::Request& request) {
  if (!request.has_param("after")) return std::nullopt;
  const std::string text = request.get_param_value("after");
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size())
    throw Error(ErrorKind::kUsage, "after must be the number of a frame");
  return number;
}

json list_of_sequences(const Farm& farm, const httplib::Request& request) {
  const auto begin = static_cast<size_t>(whole(request, "begin", 0));
  const auto count = static_cast<size_t>(whole(request, "count", kMaxSequencesOfAnswer));
  auto rows = json::array();
  for (const SequenceStatus& s : farm.sequences(begin, std::min(count, kMaxSequencesOfAnswer)))
    rows.push_back(sequence_view(s));
  return {{"total", farm.sequence_count()}, {"sequences", std::move(rows)}};
}

/// A page of frames that changed after "since"; the first page has the sequence's row, as it was before them.
json page_of_frames(const Farm& farm, const SequenceId& id, const httplib::Request& request) {
  const auto since = static_cast<uint64_t>(whole(request, "since", 0));
  const auto count = static_cast<size_t>(whole(request, "count", kMaxFramesOfAnswer));
  const size_t most = std::clamp(count, size_t{1}, kMaxFramesOfAnswer);
  FramePage page;
  page.last = frame_after(request);
  json made = json::object();
  if (!page.last) made["sequence"] = sequence_view(farm.sequence(id));
  auto rows = json::array();
  do {
    page = farm.frames(id, page.last, std::min(most - rows.size(), kFramesOfLock), since);
    for (const FrameStatus& frame : page.frames) rows.push_back(frame_view(frame));
  } while (page.last && rows.size() < most);
  made["total"] = page.total;
  made["frames"] = std::move(rows);
  if (page.last) made["next"] = *page.last;
  return made;
}

}  // namespace

std::vector<WebApi::Route> sequence_routes() {
  const std::string all(kSequences), one = all + "/*";
  std::vector<WebApi::Route> routes = {{"GET", all}, {"GET", one}, {"GET", one + "/frames"}};
  for (const std::string& name : sequence_action_names()) routes.push_back({"POST", one + "/" + name});
  return routes;
}

void answer_sequence(const WebOptions& web, const std::string& user, const httplib::Request& request,
                     httplib::Response& response) {
  if (request.path == kSequences) return answer(response, list_of_sequences(web.farm, request));
  const SequenceId id{request.matches[1].str()};
  const std::string last = request.path.substr(request.path.rfind('/') + 1);
  if (request.method == "POST") {
    act(web, last, id, request.body);
    if (web.log)
      web.log("sequence " + id.value + ": " + last + " by " +
              (user.empty() ? "a browser at " + request.remote_addr : user));
  } else if (request.path.size() > kSequences.size() + 1 + id.value.size()) {
    return answer(response, page_of_frames(web.farm, id, request));
  }
  answer(response, {{"sequence", sequence_view(web.farm.sequence(id))}});
}

}  // namespace lightmill
