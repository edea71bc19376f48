#pragma once
// The dashboard's routes: its files, JSON under /api/v1, pictures, and a stream of what changes.
// docs/dashboard.md describes them. Every one has a line in coordinator/access/access.cc.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "coordinator/access/authenticator.h"
#include "coordinator/core/farm.h"
#include "coordinator/service/event_log.h"
#include "coordinator/service/limits/quotas.h"
#include "coordinator/service/limits/submit_limit.h"
#include "coordinator/service/scenes/scene_desk.h"
#include "coordinator/service/scenes/uploads.h"
#include "coordinator/service/tile_log.h"
#include "coordinator/store/blob_store.h"

namespace httplib {
class Server;
}

namespace lightmill {

struct WebOptions {
  Farm& farm;
  BlobStore& blobs;
  const EventLog& events;
  Quotas quotas{};
  std::shared_ptr<SubmitLimit> submissions{};
  std::shared_ptr<Authenticator> authenticator{};  // null: everybody may do everything
  std::function<void(const std::string&)> log{};   // who did what
  bool loopback_only = false;                      // plain text: other sites' names are refused (guard.h)
  // Where browsers send files and scenes; null: none are taken here.
  Uploads* uploads = nullptr;
  SceneDesk* scenes = nullptr;
  const TileLog* tile_log = nullptr;  // what happened to tiles; may be null
  std::string thumbnail_folder{};     // where thumbnails are kept; empty: in memory
};

class WebApi {
 public:
  /// Most streams at a time; each takes a thread of the server. When another one comes the oldest ends.
  static constexpr int kMaxStreams = 64;
  /// Most bytes of a request's body.
  static constexpr size_t kMaxBody = size_t{1} << 20;

  explicit WebApi(const WebOptions& options);
  ~WebApi();
  /// Adds the routes; `server` must not serve any more when this object goes.
  void install(httplib::Server& server);
  /// Ends the streams.
  void stop();

  struct Route {
    std::string method;  // "GET", "POST" or "PUT"
    std::string path;    // "/api/v1/jobs/*/pause"
  };
  /// All that install() adds.
  std::vector<Route> routes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
