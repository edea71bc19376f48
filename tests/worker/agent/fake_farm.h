#pragma once
// A scripted farm and a renderer without a scene, to run the agent alone.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "worker/agent/farm_link.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill::agent::testing {

inline constexpr int kQuantum = -40;

inline FilmGrid small_grid() { return {96, 64, {0, 0, 96, 64}}; }

/// Adds 1 to every pixel of the packet, per sample.
class CountingRenderer : public PacketRenderer {
 public:
  const FilmGrid& grid() const override { return grid_; }
  int quantum_exponent() const override { return kQuantum; }
  bool has_camera_layer() const override { return true; }
  bool has_splat_layer() const override { return false; }
  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<Workspace>(); }
  void render_packet(const Packet& packet, Workspace&, PartialBuilder& builder) const override {
    while (stuck) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (packet.cell_x == fail_cell_x) throw std::runtime_error("cell on fire");
    std::vector<ExactRgb> sums(kCellPixels);
    const auto samples = static_cast<Units>(packet.sample_end - packet.sample_begin);
    for (ExactRgb& sum : sums) sum.c[0] = samples << -kQuantum;
    builder.add_camera(packet.cell_x, packet.cell_y, std::span<const ExactRgb, kCellPixels>(sums));
    RenderCounters counters;
    const PixelRect cell{packet.cell_x * kCellSize, packet.cell_y * kCellSize,
                         (packet.cell_x + 1) * kCellSize, (packet.cell_y + 1) * kCellSize};
    counters.camera_paths = static_cast<uint64_t>(cell.area()) * static_cast<uint64_t>(samples);
    builder.add_counters(counters, 0.001);
  }
  /// Waits to be cancelled, unless `pilot_report` holds what it finds; then for `pilot_rounds` looks at
  /// go_on.
  PilotReport run_pilot(int threads, const std::function<bool()>& go_on) const override {
    pilot_threads = threads;
    ++pilots_begun;
    for (int i = 0; !pilot_report || i < pilot_rounds; ++i) {
      if (!go_on()) {
        ++pilots_cancelled;
        throw Error(ErrorKind::kFailed, "interrupted");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!pilot_error.empty()) throw Error(ErrorKind::kFailed, pilot_error);
    return *pilot_report;
  }
  Image first_look(int, const std::function<bool()>&) const override {
    if (look_fails) throw Error(ErrorKind::kFailed, "nothing to see");
    Image picture(2, 3);
    picture.data[4] = 7;
    return picture;
  }
  std::shared_ptr<const PacketRenderer> with_settings(const RenderSettings&) const override {
    throw std::logic_error("one renderer is enough");
  }
  std::vector<std::string> missing_light() const override { return missing; }
  int fail_cell_x = -1;
  std::vector<std::string> missing;
  std::atomic<bool> stuck{false};  // packets take until this is false
  std::optional<PilotReport> pilot_report;
  std::string pilot_error;
  bool look_fails = false;
  int pilot_rounds = 0;
  mutable std::atomic<int> pilots_begun{0}, pilots_cancelled{0}, pilot_threads{0};

 private:
  FilmGrid grid_ = small_grid();
};

class FixedSource : public RenderSource {
 public:
  std::shared_ptr<const PacketRenderer> open(const std::string&, const RenderSettings&,
                                             const LookWanted*) override {
    if (!error.empty()) throw Error(ErrorKind::kBadScene, error);
    if (lost_file) throw MissingBlob("the coordinator has no blob");
    return renderer;
  }
  std::string find_blob(const std::string& digest) const override {
    const auto found = files.find(digest);
    return found == files.end() ? "" : found->second;
  }
  std::shared_ptr<CountingRenderer> renderer = std::make_shared<CountingRenderer>();
  std::string error;
  std::atomic<bool> lost_file{false};        // by the coordinator
  std::map<std::string, std::string> files;  // digest -> path
};

/// Hands out the tiles that it was given; may be told to misbehave.
class FakeFarm : public FarmLink {
 public:
  void register_worker(const WorkerRegistration& registration) override {
    const std::lock_guard lock(mutex_);
    if (!refusal.empty()) throw Error(ErrorKind::kUnreachable, refusal);
    if (down_calls > 0 && down_calls--) throw LinkDown("no route");
    registered = true;
    ++registrations;
    last_registration = registration;
  }
  std::optional<LeaseGrant> lease(double wait_seconds) override {
    std::unique_lock lock(mutex_);
    check();
    changed_.wait_for(lock, std::chrono::duration<double>(std::min(wait_seconds, 0.02)));
    if (pending.empty()) return std::nullopt;
    LeaseGrant lease = pending.front();
    pending.pop_front();
    most_held = std::max(most_held, ++held);
    return lease;
  }
  std::vector<LeaseKey> renew(const std::vector<LeaseKey>& keys) override {
    const std::lock_guard lock(mutex_);
    check();
    ++renewals;
    std::vector<LeaseKey> lost;
    for (const LeaseKey& key : keys) {
      if (lose.count(key)) lost.push_back(key);
    }
    return lost;
  }
  CommitAnswer commit(const LeaseKey& key, const std::string& bytes) override {
    const std::lock_guard lock(mutex_);
    check();
    if (no_memory) throw std::bad_alloc();
    --held;
    commits[key].push_back(bytes);
    changed_.notify_all();
    return {CommitResult::kAccepted, ""};
  }
  void fail(const LeaseKey& key, const std::string& reason, FailureKind) override {
    const std::lock_guard lock(mutex_);
    check();
    --held;
    failures[key] = reason;
    changed_.notify_all();
  }
  void show(const LeaseKey&, const Image& picture) override {
    const std::lock_guard lock(mutex_);
    check();
    shown.push_back(picture);
  }
  void warn(const LeaseKey& key, const std::vector<std::string>& missing_light) override {
    const std::lock_guard lock(mutex_);
    check();
    warnings.emplace_back(key, missing_light);
  }
  void hand_back(const LeaseKey& key, HandBack why) override {
    const std::lock_guard lock(mutex_);
    check();
    --held;
    handed_back.insert(key);
    if (why == HandBack::kMissingBlob) ++missing_blobs;
    changed_.notify_all();
  }
  void drain() override {
    const std::lock_guard lock(mutex_);
    drained = true;
  }
  Bundle bundle(const std::string& digest) override { return bundles.at(digest); }
  void fetch_blobs(const std::vector<std::string>& digests, BlobSink& sink) override {
    for (const std::string& digest : digests) {
      const std::string& content = blobs.at(digest);
      sink.begin(digest, content.size());
      sink.write(std::string_view(content).substr(0, 3));
      if (content.size() > 3) sink.write(std::string_view(content).substr(3));
      sink.end();
      ++blobs_sent;
    }
  }
  std::vector<std::string> take_wanted_blobs() override {
    const std::lock_guard lock(mutex_);
    return wanted;
  }
  bool hand_in_blob(const std::string& digest, const std::string&) override {
    const std::lock_guard lock(mutex_);
    if (down_calls > 0 && down_calls--) throw LinkDown("no route");
    handed_in.push_back(digest);
    changed_.notify_all();
    return true;
  }
  void cancel() override {
    const std::lock_guard lock(mutex_);
    cancelled = true;
    changed_.notify_all();
  }

  void add(const TileSpec& tile, double lease_seconds = 10) {
    const std::lock_guard lock(mutex_);
    pending.push_back({JobId{"j1"}, TileId{next_tile_++}, 1, tile, {}, "digest", lease_seconds});
    changed_.notify_all();
  }
  /// Blocks until so many tiles were committed or failed; false after a generous time.
  bool wait_for_answers(size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60),
                             [&] { return commits.size() + failures.size() >= count; });
  }

  std::mutex mutex_;
  std::deque<LeaseGrant> pending;
  std::map<LeaseKey, std::vector<std::string>> commits;
  std::set<LeaseKey> handed_back;
  std::map<LeaseKey, std::string> failures;
  std::vector<std::pair<LeaseKey, std::vector<std::string>>> warnings;
  std::vector<Image> shown;
  std::map<LeaseKey, bool> lose;
  std::string refusal;
  int down_calls = 0;      // so many calls throw LinkDown
  bool forget = false;     // the next call throws NotRegistered
  bool no_memory = false;  // to hand anything in
  std::map<std::string, Bundle> bundles;
  std::map<std::string, std::string> blobs;  // digest -> content, which may be a lie
  int blobs_sent = 0;
  std::vector<std::string> wanted, handed_in;
  int missing_blobs = 0;  // tiles that were handed back for lack of one
  bool registered = false, drained = false, cancelled = false;
  int registrations = 0, renewals = 0, held = 0, most_held = 0;
  WorkerRegistration last_registration;

 private:
  void check() {
    if (cancelled) throw LinkDown("cancelled");
    if (down_calls > 0) {
      --down_calls;
      throw LinkDown("no route");
    }
    if (forget || !registered) {
      forget = registered = false;
      throw NotRegistered("who are you?");
    }
  }
  std::condition_variable changed_;
  int64_t next_tile_ = 0;
};

}  // namespace lightmill::agent::testing
