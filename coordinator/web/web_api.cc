#include "coordinator/web/web_api.h"

#include <httplib.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <iterator>
#include <nlohmann/json.hpp>

#include "coordinator/http_api/caller_slots.h"
#include "coordinator/service/limits/in_flight_limit.h"
#include "coordinator/web/actions.h"
#include "coordinator/web/answers.h"
#include "coordinator/web/assets.h"
#include "coordinator/web/denoised/denoised_pictures.h"
#include "coordinator/web/feed.h"
#include "coordinator/web/guard.h"
#include "coordinator/web/job_follower.h"
#include "coordinator/web/json_views.h"
#include "coordinator/web/light_mix/light_mixes.h"
#include "coordinator/web/picture_answers.h"
#include "coordinator/web/pictures.h"
#include "coordinator/web/scene_submit.h"
#include "coordinator/web/sequence_routes.h"
#include "coordinator/web/thumbnails/thumbnails.h"

namespace lightmill {
namespace {

using httplib::Request;
using httplib::Response;
using nlohmann::json;

constexpr double kBeatSeconds = 2;  // a browser that hears nothing for some of these has lost us
constexpr int kSpareStreams = 8;    // until the oldest has made room
constexpr int kMaxPictures = 8;     // made or encoded at once
constexpr int kMaxMixes = 16, kMaxMixesOfCaller = 2;
constexpr int64_t kMaxTileLines = 500;   // of one answer
constexpr size_t kMaxListedJobs = 1000;  // of one answer
constexpr size_t kMaxListedWorkers = 1000, kTimelinesOfLock = 100;

/// The pattern of a path in which "*" is one segment.
std::string pattern(const std::string& path) {
  std::string text;
  for (const char c : path) text += c == '*' ? "([^/]+)" : c == '.' ? "\\." : std::string(1, c);
  return text;
}

}  // namespace

struct WebApi::Impl {
  explicit Impl(const WebOptions& options)
      : web(options),
        feed(options.farm, options.events),
        pictures(options.farm),
        thumbnails(options.farm, options.thumbnail_folder, options.log),
        denoised_pictures(options.farm, pictures),
        light_mixes(options.farm) {}

  using Handler = void (Impl::*)(const Request&, Response&);
  struct Entry {
    Route route;
    Handler handler;
  };
  static const std::vector<Entry>& entries();

  Verdict judge(const Request& request, const std::string& path) const {
    if (!web.authenticator) return {Verdict::Kind::kAllowed, "", ""};
    return web.authenticator->judge(path, request.get_header_value("Authorization"), std::time(nullptr));
  }
  json session(const Request& request) const {
    return {{"instance", feed.instance()},
            {"user", judge(request, "/api/v1/session").name},
            {"may_act", judge(request, "/api/v1/jobs/any/pause").kind == Verdict::Kind::kAllowed},
            {"roles", web.authenticator != nullptr}};
  }
  static JobId job_of(const Request& request) { return JobId{request.matches[1].str()}; }

  void asset(const Request& request, Response& response);
  void get_session(const Request& request, Response& response) { answer(response, session(request)); }
  void jobs(const Request& request, Response& response);
  void job(const Request& request, Response& response);
  void curve(const Request& request, Response& response);
  void tiles(const Request& request, Response& response);
  void workers(const Request& request, Response& response);
  void timeline(const Request& request, Response& response);
  void log(const Request& request, Response& response);
  void tile_log(const Request& request, Response& response);
  void events(const Request& request, Response& response);
  void picture(const Request& request, Response& response) {
    answer_image(pictures, job_of(request), request, response);
  }
  void denoised(const Request& request, Response& response) {
    answer_denoised(denoised_pictures, job_of(request), request, response);
  }
  void light_mix(const Request& request, Response& response) {
    const std::string user = judge(request, request.path).name;
    const CallerSlots::Place place(mixing, user.empty() ? request.remote_addr : user);
    if (!place.granted()) throw LimitReached("too many light mixes are being made at once; try again");
    answer_light_mix(web.farm, light_mixes, job_of(request), request, response);
  }
  void thumbnail(const Request& request, Response& response) {
    answer_thumbnail(thumbnails, job_of(request), request, response);
  }
  void error_map(const Request& request, Response& response) {
    answer_error_map(pictures, job_of(request), response);
  }
  void png(const Request& request, Response& response) {
    answer_png(pictures, web.farm.job(job_of(request)).id, feed.instance(), request, response);
  }
  void exr(const Request& request, Response& response) {
    answer_exr(web.farm, web.farm.job(job_of(request)).id, feed.instance(), response);
  }
  void action(const Request& request, Response& response);
  void upload(const Request& request, Response& response);
  void scene(const Request& request, Response& response);
  void sequence(const Request& request, Response& response) {
    answer_sequence(web, judge(request, request.path).name, request, response);
  }

  const WebOptions web;
  Feed feed;
  Pictures pictures;
  Thumbnails thumbnails;
  DenoisedPictures denoised_pictures;
  LightMixes light_mixes;
  CallerSlots mixing{kMaxMixes, kMaxMixesOfCaller};
  std::atomic<int> streams{0}, making{0};
  std::atomic<uint64_t> streams_begun{0};
};

const std::vector<WebApi::Impl::Entry>& WebApi::Impl::entries() {
  static const std::vector<Entry> all = [] {
    std::vector<Entry> made = {{{"GET", "/"}, &Impl::asset},
                               {{"GET", "/assets/*"}, &Impl::asset},
                               {{"GET", "/api/v1/session"}, &Impl::get_session},
                               {{"GET", "/api/v1/events"}, &Impl::events},
                               {{"GET", "/api/v1/jobs"}, &Impl::jobs},
                               {{"GET", "/api/v1/jobs/*"}, &Impl::job},
                               {{"GET", "/api/v1/jobs/*/curve"}, &Impl::curve},
                               {{"GET", "/api/v1/jobs/*/tiles"}, &Impl::tiles},
                               {{"GET", "/api/v1/jobs/*/log"}, &Impl::tile_log},
                               {{"GET", "/api/v1/jobs/*/image"}, &Impl::picture},
                               {{"GET", "/api/v1/jobs/*/denoised"}, &Impl::denoised},
                               {{"GET", "/api/v1/jobs/*/light-mix"}, &Impl::light_mix},
                               {{"GET", "/api/v1/jobs/*/thumbnail"}, &Impl::thumbnail},
                               {{"GET", "/api/v1/jobs/*/image.png"}, &Impl::png},
                               {{"GET", "/api/v1/jobs/*/image.exr"}, &Impl::exr},
                               {{"GET", "/api/v1/jobs/*/error-map"}, &Impl::error_map},
                               {{"GET", "/api/v1/workers"}, &Impl::workers},
                               {{"GET", "/api/v1/workers/timeline"}, &Impl::timeline},
                               {{"GET", "/api/v1/log"}, &Impl::log}};
    for (const std::string& name : action_names())
      made.push_back({{"POST", "/api/v1/jobs/*/" + name}, &Impl::action});
    made.push_back({{"PUT", "/api/v1/blobs/*"}, &Impl::upload});
    for (const char* name : {"check", "submit"})
      made.push_back({{"POST", std::string("/api/v1/scene/") + name}, &Impl::scene});
    for (const Route& route : sequence_routes()) made.push_back({route, &Impl::sequence});
    return made;
  }();
  return all;
}

void WebApi::Impl::asset(const Request& request, Response& response) {
  for (const Asset& asset : dashboard_assets()) {
    if (asset.path != request.path) continue;
    const std::string tag = "\"" + std::string(asset.digest) + "\"";
    response.set_header("ETag", tag);
    response.set_header("Cache-Control", "no-cache");  // ask, as another build has other bytes
    if (request.get_header_value("If-None-Match") == tag) {
      response.status = 304;
    } else {
      response.set_content(asset.bytes.data(), asset.bytes.size(), std::string(asset.type).c_str());
    }
    return;
  }
  refuse(response, 404, "no page " + request.path.substr(0, 200));
}

void WebApi::Impl::jobs(const Request& request, Response& response) {
  const auto begin = static_cast<size_t>(whole(request, "begin", 0));
  const auto count = static_cast<size_t>(whole(request, "count", kMaxListedJobs));
  const JobPage page = web.farm.page(begin, std::min(count, kMaxListedJobs), 0, true);
  auto rows = json::array();
  for (const JobStatus& job : page.jobs) rows.push_back(job_view(job));
  answer(response, {{"total", page.total}, {"jobs", std::move(rows)}});
}

void WebApi::Impl::job(const Request& request, Response& response) {
  const JobStatus status = web.farm.job(job_of(request));
  json view = job_view(status);
  view["detail"] = job_detail_view(status, web.farm.pilot(status.id));
  answer(response, view);
}

void WebApi::Impl::curve(const Request& request, Response& response) {
  answer(response, curve_view(web.farm.curve(job_of(request))));
}

void WebApi::Impl::tiles(const Request& request, Response& response) {
  const TileMap map = web.farm.tile_map(job_of(request));
  auto tiles = json::array();
  for (const TileStatus& tile : map.tiles) {
    tiles.push_back(tile_view(tile));
    if (const auto lease = map.leased_seconds.find(tile.id); lease != map.leased_seconds.end())
      tiles.back()["leased_seconds"] = lease->second;
  }
  answer(response, {{"complete_samples", map.complete_samples}, {"tiles", std::move(tiles)}});
}

void WebApi::Impl::workers(const Request&, Response& response) {
  std::map<WorkerId, std::vector<LeaseKey>> held;
  for (const auto& [worker, key] : web.farm.holdings()) held[worker].push_back(key);
  auto rows = json::array();
  for (const WorkerStatus& worker : web.farm.workers()) rows.push_back(worker_view(worker, held[worker.id]));
  answer(response, rows);
}

void WebApi::Impl::timeline(const Request& request, Response& response) {
  const auto count = static_cast<size_t>(whole(request, "count", kMaxListedWorkers));
  const int64_t since = request.has_param("since") ? whole(request, "since", 0) : INT64_MIN;
  const size_t most = std::clamp(count, size_t{1}, kMaxListedWorkers);
  TimelinePage all, page;
  page.last = WorkerId{request.get_param_value("after")};
  do {  // others get at the farm in between
    page = web.farm.timelines(page.last, std::min(most - all.workers.size(), kTimelinesOfLock), since);
    std::move(page.workers.begin(), page.workers.end(), std::back_inserter(all.workers));
  } while (!page.last.empty() && all.workers.size() < most);
  page.workers = std::move(all.workers);
  answer(response, timeline_view(page));
}

void WebApi::Impl::log(const Request& request, Response& response) {
  answer(response, log_view(web.events.after(static_cast<uint64_t>(whole(request, "after", 0)))));
}

void WebApi::Impl::tile_log(const Request& request, Response& response) {
  const JobId id = web.farm.job(job_of(request)).id;
  std::optional<TileId> tile;
  if (request.has_param("tile")) tile = TileId{whole(request, "tile", 0)};
  const int64_t count = std::min(whole(request, "count", kMaxTileLines), kMaxTileLines);
  answer(response, tile_log_view(web.tile_log ? web.tile_log->of(id, tile, static_cast<size_t>(count))
                                              : std::vector<TileLog::Line>()));
}

void WebApi::Impl::events(const Request& request, Response& response) {
  struct Stream {
    Stream(Impl& impl, Feed::Cursor at)
        : slot(impl.streams, kMaxStreams + kSpareStreams),
          number(impl.streams_begun++),
          listener(impl.feed),
          cursor(at) {}
    /// The oldest ends where there are too many. Its browser comes back, and goes on where it was.
    bool makes_room(const Impl& impl) const {
      return impl.streams > kMaxStreams && impl.streams_begun - number > uint64_t{kMaxStreams};
    }
    const Slot slot;
    const uint64_t number;
    const Feed::Listener listener;
    Feed::Cursor cursor;
    std::string begin;
    std::optional<JobFollower> follower;
  };
  std::string since = request.get_header_value("Last-Event-ID");
  if (since.empty()) since = request.get_param_value("since");
  const auto stream = std::make_shared<Stream>(*this, feed.cursor(since));
  if (!stream->slot.granted()) {
    response.set_header("Retry-After", "5");
    return refuse(response, 503, std::to_string(kMaxStreams) + " browsers watch already; close some");
  }
  if (request.has_param("job")) stream->follower.emplace(web.farm, JobId{request.get_param_value("job")});
  stream->begin = "event: hello\ndata: " + json_text(session(request)) + "\n\n";
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Accel-Buffering", "no");  // of proxies that would collect what must flow
  response.set_chunked_content_provider("text/event-stream", [this, stream](size_t, httplib::DataSink& sink) {
    if (stream->makes_room(*this)) return false;
    std::string text = std::exchange(stream->begin, "");
    // The first events go out at once, before anything is waited for.
    if (text.empty()) {
      try {
        text = feed.next(stream->listener, &stream->cursor, kBeatSeconds);
        if (stream->follower) text += stream->follower->next();
      } catch (const std::exception&) {
        return false;  // the disk fails; the browser comes back
      }
      if (text.empty()) text = "event: beat\ndata: {}\n\n";
    }
    return sink.write(text.data(), text.size());
  });
}

void WebApi::Impl::upload(const Request& request, Response& response) {
  if (!web.uploads) throw Error(ErrorKind::kFailed, "this coordinator takes no files");
  const double now =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  const Uploads::Progress progress =
      web.uploads->put(judge(request, request.path).name, request.matches[1].str(),
                       static_cast<uint64_t>(whole(request, "size", 0)),
                       static_cast<uint64_t>(whole(request, "offset", 0)), request.body, now);
  answer(response, {{"received", progress.received}, {"complete", progress.complete}});
}

void WebApi::Impl::scene(const Request& request, Response& response) {
  if (request.path.ends_with("/check")) return answer(response, check_scene(web, request.body));
  const std::string user = judge(request, request.path).name;
  const JobId made = submit_scene(web, request.body, user);
  if (web.log)
    web.log("job " + made.value + ": submitted by " +
            (user.empty() ? "a browser at " + request.remote_addr : user));
  answer(response, {{"job", job_view(web.farm.job(made))}});
}

void WebApi::Impl::action(const Request& request, Response& response) {
  const JobId id = job_of(request);
  const std::string name = request.path.substr(request.path.rfind('/') + 1);
  const std::string user = judge(request, request.path).name;
  const JobId changed = act(web, name, id, request.body, user);
  if (web.log) {
    web.log("job " + changed.value + ": " +
            (name == "resubmit" ? "submitted as " + id.value + " again" : name) + " by " +
            (user.empty() ? "a browser at " + request.remote_addr : user));
  }
  answer(response, {{"job", job_view(web.farm.job(changed))}});
}

WebApi::WebApi(const WebOptions& options) : impl_(std::make_unique<Impl>(options)) {}
WebApi::~WebApi() = default;

void WebApi::stop() { impl_->feed.stop(); }

std::vector<WebApi::Route> WebApi::routes() const {
  std::vector<Route> routes;
  for (const Impl::Entry& entry : Impl::entries()) routes.push_back(entry.route);
  return routes;
}

void WebApi::install(httplib::Server& server) {
  server.set_default_headers(security_headers());
  for (const Impl::Entry& entry : Impl::entries()) {
    const bool changes = entry.route.method != "GET";
    const auto handler = [impl = impl_.get(), run = entry.handler, changes](const Request& request,
                                                                            Response& response) {
      guarded_answer(response, [&] {
        if (impl->web.loopback_only) {
          if (const std::string why = foreign_host(request); !why.empty()) return refuse(response, 403, why);
        }
        if (changes) {
          if (const std::string why = forgery(request); !why.empty()) return refuse(response, 403, why);
        }
        const bool heavy = run == &Impl::picture || run == &Impl::denoised || run == &Impl::png ||
                           run == &Impl::exr || run == &Impl::error_map;
        if (!heavy) return (impl->*run)(request, response);
        const Slot slot(impl->making, kMaxPictures);
        if (!slot.granted()) throw LimitReached("too many pictures are being made at once; try again");
        (impl->*run)(request, response);
      });
    };
    if (entry.route.method == "POST") {
      server.Post(pattern(entry.route.path), handler);
    } else if (entry.route.method == "PUT") {
      server.Put(pattern(entry.route.path), handler);
    } else {
      server.Get(pattern(entry.route.path), handler);
    }
  }
}

}  // namespace lightmill
