// A disk that fails, slipped between a program and libc by LD_PRELOAD: no code of the program knows of it.
// Every call that changes a file below CHAOS_FOLDER is counted and may be the one before which the power is
// cut, or may fail as on a full or broken disk. CHAOS_CONTROL names a file of 64 bytes that the test maps and
// writes (disk_control.py).
//
// A power cut is kinder to a program than to a disk: what was not synced is taken back sector by sector, by a
// seeded coin, names included, and the process is killed where it stands.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace {

constexpr size_t kSector = 512;

/// What the test and the program share; all words are little-endian and 8 bytes long.
struct Control {
  uint64_t calls;          // so far, counted here
  uint64_t cut_at;         // the call before which the process dies; 0: never
  uint64_t power_seed;     // 0: the process is killed, the disk goes on; else what was not synced is lost
  uint64_t error;          // errno of failing calls; 0: none fail
  uint64_t error_one_in;   // one call of so many fails; 0 as 1
  uint64_t sync_delay_us;  // every sync takes so much longer
  uint64_t failed;         // calls that were failed, counted here
  uint64_t struck;         // before which call the process died: a Call, counted from 1
};

/// In the order of CALLS in disk_control.py.
enum Call : uint64_t { kWrite = 1, kSync = 2, kResize = 5, kRename = 6, kUnlink = 7 };

/// A file's bytes as the disk surely has them, where they differ from what was written since.
struct Unsynced {
  std::map<uint64_t, std::string>
      old_sectors;  // number -> content before the first write; shorter at the end
  off_t old_size = -1;
};

struct State {
  std::string folder;
  Control* control = nullptr;
  std::recursive_mutex mutex;
  std::map<std::string, Unsynced> files;
  std::vector<std::pair<std::string, std::string>> renames;  // that no sync of the folder followed
};

template <class F>
F* real(F*, const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}
#define REAL(function) static auto* const real_##function = real(&::function, #function)

State& state() {
  static State* const made = [] {
    auto* s = new State;  // never freed: other threads may run to the end
    const char* folder = getenv("CHAOS_FOLDER");
    const char* control = getenv("CHAOS_CONTROL");
    if (!folder || !control) return s;
    const int fd = static_cast<int>(syscall(257 /* openat */, AT_FDCWD, control, O_RDWR | O_CLOEXEC, 0));
    if (fd < 0) abort();
    void* at = mmap(nullptr, sizeof(Control), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (at == MAP_FAILED) abort();
    s->control = static_cast<Control*>(at);
    s->folder = folder;
    return s;
  }();
  return *made;
}

/// Path of an open file below the folder; empty for all others. The log's index is made anew after a crash.
std::string path_of(int fd) {
  State& s = state();
  if (!s.control) return {};
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t n = readlink(link, path, sizeof path);
  if (n <= 0) return {};
  const std::string result(path, static_cast<size_t>(n));
  return result.starts_with(s.folder) ? result : std::string();
}
bool below(const char* path) {
  State& s = state();
  return s.control && path && strncmp(path, s.folder.c_str(), s.folder.size()) == 0;
}
bool is_index(const std::string& path) { return path.ends_with("-shm"); }

uint64_t mixed(uint64_t a, uint64_t b) {
  uint64_t x = (a + 0x9e3779b97f4a7c15u) * 0xbf58476d1ce4e5b9u ^ b * 0x94d049bb133111ebu;
  x ^= x >> 29;
  x *= 0xbf58476d1ce4e5b9u;
  return x ^ (x >> 32);
}

/// Keeps what lies in [begin, end) before it is overwritten for the first time since the last sync.
void remember(int fd, const std::string& path, off_t begin, off_t end) {
  struct stat info;
  if (is_index(path) || fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) return;
  Unsynced& file = state().files[path];
  if (file.old_size < 0) file.old_size = info.st_size;
  for (uint64_t sector = static_cast<uint64_t>(begin) / kSector;
       sector * kSector < static_cast<uint64_t>(end); ++sector) {
    if (file.old_sectors.contains(sector)) continue;
    char bytes[kSector];
    const ssize_t n = pread(fd, bytes, kSector, static_cast<off_t>(sector * kSector));
    file.old_sectors[sector].assign(bytes, n > 0 ? static_cast<size_t>(n) : 0);
  }
}

void lose_unsynced(uint64_t seed) {
  State& s = state();
  REAL(pwrite64);
  REAL(ftruncate64);
  REAL(rename);
  for (auto rename = s.renames.rbegin(); rename != s.renames.rend(); ++rename) {
    if (mixed(++seed, 1) & 1) real_rename(rename->second.c_str(), rename->first.c_str());
  }
  for (const auto& [path, file] : s.files) {
    const int fd = static_cast<int>(syscall(257, AT_FDCWD, path.c_str(), O_RDWR | O_CLOEXEC, 0));
    if (fd < 0) continue;  // it was removed meanwhile
    struct stat info;
    if (fstat(fd, &info) != 0) abort();
    const off_t size = mixed(++seed, 1) & 1 ? info.st_size : file.old_size;
    for (const auto& [sector, old] : file.old_sectors) {
      if (mixed(seed, sector + 17) & 1) continue;  // this one reached the disk
      std::string bytes = old;
      bytes.resize(kSector, '\0');
      real_pwrite64(fd, bytes.data(), bytes.size(), static_cast<off_t>(sector * kSector));
    }
    if (file.old_size >= 0) real_ftruncate64(fd, size);
    close(fd);
  }
}

/// What the test is told of a call on this file.
uint64_t word_of(Call call, const std::string& path) {
  if (call != kWrite && call != kSync) return call;
  if (path.ends_with("-wal")) return call;
  return path.ends_with(".sqlite") ? call + 2 : call + 7;
}

/// Counts a call. True if it is to fail with errno.
bool strikes(Call kind, const std::string& path) {
  State& s = state();
  Control& c = *s.control;
  const uint64_t call = ++c.calls;
  if (c.cut_at && call >= c.cut_at) {
    if (c.power_seed) lose_unsynced(c.power_seed);
    c.cut_at = 0;
    c.struck = word_of(kind, path);
    kill(getpid(), SIGKILL);
    pause();
  }
  if (!c.error || mixed(c.error_one_in, call) % std::max<uint64_t>(1, c.error_one_in) != 0) return false;
  ++c.failed;
  errno = static_cast<int>(c.error);
  return true;
}

int synced(int fd, int (*sync)(int)) {
  const std::string path = path_of(fd);
  if (path.empty()) return sync(fd);
  State& s = state();
  if (s.control->sync_delay_us) usleep(static_cast<useconds_t>(s.control->sync_delay_us));
  const std::lock_guard lock(s.mutex);
  if (strikes(kSync, path)) return -1;
  const int result = sync(fd);
  if (result == 0) {
    s.files.erase(path);
    std::erase_if(s.renames, [&](const auto& r) { return r.second.substr(0, r.second.rfind('/')) == path; });
  }
  return result;
}

}  // namespace

extern "C" {

ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t offset) {
  REAL(pwrite64);
  const std::string path = path_of(fd);
  if (path.empty()) return real_pwrite64(fd, bytes, count, offset);
  const std::lock_guard lock(state().mutex);
  if (strikes(kWrite, path)) {
    if (errno != ENOSPC || count < 2) return -1;
    remember(fd, path, offset, offset + static_cast<off_t>(count / 2));
    return real_pwrite64(fd, bytes, count / 2, offset);  // what still fits; the rest fails
  }
  remember(fd, path, offset, offset + static_cast<off_t>(count));
  return real_pwrite64(fd, bytes, count, offset);
}

ssize_t write(int fd, const void* bytes, size_t count) {
  REAL(write);
  const std::string path = path_of(fd);
  if (path.empty()) return real_write(fd, bytes, count);
  const std::lock_guard lock(state().mutex);
  if (strikes(kWrite, path)) return -1;
  const off_t offset = lseek(fd, 0, SEEK_CUR);
  if (offset >= 0) remember(fd, path, offset, offset + static_cast<off_t>(count));
  return real_write(fd, bytes, count);
}

int ftruncate64(int fd, off64_t size) {
  REAL(ftruncate64);
  const std::string path = path_of(fd);
  if (path.empty()) return real_ftruncate64(fd, size);
  const std::lock_guard lock(state().mutex);
  if (strikes(kResize, path)) return -1;
  struct stat info;
  if (fstat(fd, &info) == 0)
    remember(fd, path, std::min<off_t>(size, info.st_size), std::max<off_t>(size, info.st_size));
  return real_ftruncate64(fd, size);
}

int fsync(int fd) {
  REAL(fsync);
  return synced(fd, real_fsync);
}

int fdatasync(int fd) {
  REAL(fdatasync);
  return synced(fd, real_fdatasync);
}

int rename(const char* from, const char* to) {
  REAL(rename);
  if (!below(to)) return real_rename(from, to);
  const std::lock_guard lock(state().mutex);
  if (strikes(kRename, to)) return -1;
  const int result = real_rename(from, to);
  if (result == 0) {
    State& s = state();
    s.renames.emplace_back(from, to);
    if (const auto file = s.files.find(from); file != s.files.end()) {
      s.files[to] = std::move(file->second);
      s.files.erase(from);
    }
  }
  return result;
}

int unlink(const char* path) {
  REAL(unlink);
  if (!below(path)) return real_unlink(path);
  const std::lock_guard lock(state().mutex);
  if (strikes(kUnlink, path)) return -1;
  state().files.erase(path);
  return real_unlink(path);
}

}  // extern "C"
