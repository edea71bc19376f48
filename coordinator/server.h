#pragma once
// A running coordinator: farm + blobs behind gRPC and HTTP. main.cc wires it to flags, tests
// start it in process.
#include <functional>
#include <memory>
#include <string>

#include "common/rpc/security.h"
#include "coordinator/core/farm.h"
#include "coordinator/http/metrics.h"
#include "coordinator/scene/scene_reader.h"
#include "coordinator/service/event_log.h"
#include "coordinator/service/limits/quotas.h"
#include "coordinator/service/tile_log.h"
#include "coordinator/service/wanted_blobs.h"
#include "coordinator/store/blob_store.h"

namespace lightmill {

struct ServerOptions {
  std::string listen = "127.0.0.1:7070";          // gRPC, HOST:PORT; port 0: any
  std::string http = "127.0.0.1:7071";            // HTTP, or empty for none
  bool insecure = false;                          // plain text beyond loopback was asked for
  double lease_seconds = 10;                      // told to workers
  SecurityFiles security{};                       // resolved; with TLS all calls and pages need a token
  std::function<void(const std::string&)> log{};  // may be empty
  Quotas quotas{};
  EventLog* events = nullptr;  // what the dashboard shows as log; may be null
  MetricsOptions metrics{};
  /// Reads scenes that come by HTTP (web/web_api.h); may be empty.
  std::function<SceneAnswer(const SceneQuestion&)> read_scene{};
  WantedBlobs* wanted = nullptr;  // lost blobs that workers may hand in; outlives the server; null: none
  TileLog* tile_log =
      nullptr;  // what happens to tiles is added to it; outlives the server; null: one of its own
  std::string thumbnail_folder{};  // where the dashboard's thumbnails are kept; empty: in memory
};

class Server {
 public:
  /// Listens on both. Throws Error(kUsage) if plain text isn't allowed there, Error(kFailed) if an address
  /// can't be bound, Error(kUsage) if the tokens can't be read. `farm` and `blobs` must outlive the server.
  Server(const ServerOptions& options, Farm& farm, BlobStore& blobs);
  /// Ends streams and long polls, lets calls in progress finish for a few seconds, then cuts them.
  ~Server();
  int rpc_port() const;
  /// 0 without HTTP.
  int http_port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
