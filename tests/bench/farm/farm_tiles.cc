// Whether a coordinator stays as quick and as small as it was however many tiles it has merged: one farm on
// an SQLite store, with a job whose tiles are as small as can be, leased and committed in turn.
//
//   farm_tiles [TILES [FOLDER]]     1000000 tiles take some minutes; FOLDER (default: .) gets a store for the
//   while
//
// Prints a line at each power of ten: resident memory, and processor time of a lease + commit since the last
// line.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "coordinator/core/farm.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/bench/farm/grey_partial.h"

namespace {

using namespace lightmill;

constexpr int kSize = 512;  // pixels, square: 256 tiles a round
constexpr double kLeaseSeconds = 3600;

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

double resident_megabytes() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// As by so slow a worker that tiles never grow.
constexpr double kTileSeconds = 100;

/// Removes what it has made.
struct Folder {
  explicit Folder(const std::string& parent) : path(parent + "/farm-tiles-XXXXXX") {
    if (!mkdtemp(path.data())) throw Error(ErrorKind::kFailed, parent + ": no folder can be made there");
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::string path;
};

void run(int64_t tiles, const std::string& parent) {
  const Folder folder(parent);
  FakeClock clock;
  FarmOptions options;
  options.build = "bench";
  options.lease_seconds = kLeaseSeconds;
  options.checkpoint_bytes = 4e6;
  Farm farm(std::make_unique<SqliteJobStore>(folder.path + "/store.sqlite"), clock, options);
  JobRequest request;
  request.name = "many tiles";
  request.bundle.main = "scene.pbrt";
  request.bundle.entries = {{"scene.pbrt", std::string(64, '0'), 1}};
  request.settings.integrator = Integrator::kPt;
  request.settings.grid = {kSize, kSize, {0, 0, kSize, kSize}};
  request.settings.spp = kMaxSpp;
  farm.submit(request);
  const WorkerId worker = farm.register_worker({"bench", 1, "bench", 0, "class", ""});
  double spent = 0;  // by the coordinator, since the last line
  int64_t line = 10, before = 0;
  for (int64_t done = 1; done <= tiles; ++done) {
    double start = processor_seconds();
    const auto grant = farm.lease(worker);
    spent += processor_seconds() - start;
    if (!grant) throw Error(ErrorKind::kFailed, "no tile is left after " + std::to_string(done - 1));
    const std::string bytes = grey_partial(*grant, kTileSeconds);
    clock.advance(1);
    start = processor_seconds();
    if (farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, bytes) != CommitResult::kAccepted)
      throw Error(ErrorKind::kFailed, "a commit was refused");
    spent += processor_seconds() - start;
    if (done < line && done < tiles) continue;
    std::printf("%9lld tiles: %.1f MB resident, %.1f us a lease and commit\n", static_cast<long long>(done),
                resident_megabytes(), 1e6 * spent / static_cast<double>(done - before));
    std::fflush(stdout);
    before = done;
    spent = 0;
    while (line <= done) line *= 10;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int64_t tiles = argc > 1 ? std::atoll(argv[1]) : 1000000;
  if (argc > 3 || tiles < 1) {
    std::fprintf(stderr, "usage: farm_tiles [TILES [FOLDER]]\n");
    return 2;
  }
  try {
    run(tiles, argc > 2 ? argv[2] : ".");
  } catch (const Error& error) {
    std::fprintf(stderr, "farm_tiles: %s\n", error.what());
    return 1;
  }
  return 0;
}
