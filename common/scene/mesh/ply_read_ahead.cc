#include "common/scene/mesh/ply_read_ahead.h"

#include <filesystem>
#include <new>
#include <utility>

#include "common/base/parallel.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/mesh/ply_reader.h"

namespace lightmill {
namespace {

// Meshes may wait to be taken up to this much memory; and a file that takes more is not read on a guess.
constexpr size_t kMaxBytesHeld = size_t{256} << 20;

CleanMesh read_clean(const std::string& path) {
  CleanMesh out{read_ply(path)};
  out.dropped_triangles = drop_zero_area_triangles(&out.mesh);
  out.mended_normals = mend_zero_normals(&out.mesh);
  return out;
}

size_t bytes_of(const TriangleMesh& mesh) {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof v[0]; };
  return bytes(mesh.positions) + bytes(mesh.normals) + bytes(mesh.uvs) + bytes(mesh.colors) +
         bytes(mesh.triangles);
}

/// Of a regular file that may be read on a guess. A packed one says nothing of its size in memory.
bool may_guess(const std::string& path) {
  std::error_code error;
  return !path.ends_with(".gz") && std::filesystem::is_regular_file(path, error) &&
         std::filesystem::file_size(path, error) <= kMaxBytesHeld / 4 && !error;
}

}  // namespace

std::vector<std::string> plymesh_files(std::string_view text) {
  constexpr std::string_view kShape = "\"plymesh\"", kName = "filename\"";
  std::vector<std::string> files;
  for (size_t at = text.find(kShape); at != std::string_view::npos;) {
    const size_t next = text.find(kShape, at + kShape.size());
    const std::string_view directive = text.substr(at + kShape.size(), next - at - kShape.size());
    at = next;
    const size_t name = directive.find(kName);
    if (name == std::string_view::npos) continue;
    const size_t open = directive.find('"', name + kName.size());
    const size_t close = open == std::string_view::npos ? open : directive.find('"', open + 1);
    if (close != std::string_view::npos) files.emplace_back(directive.substr(open + 1, close - open - 1));
  }
  return files;
}

PlyReadAhead::PlyReadAhead(int threads) : threads_(thread_count(threads)) {}

PlyReadAhead::~PlyReadAhead() {
  for (std::jthread& thread : pool_) thread.request_stop();
}

void PlyReadAhead::expect(const std::vector<std::string>& paths) {
  if (threads_ < 2) return;
  std::vector<std::string> guesses;
  for (const std::string& path : paths) {
    if (may_guess(path)) guesses.push_back(path);
  }
  const std::lock_guard lock(mutex_);
  for (std::string& path : guesses) {
    if (by_path_.contains(path)) continue;
    File& file = files_.emplace_back();
    file.path = std::move(path);
    by_path_[file.path] = &file;
  }
  const size_t helpers = std::min(static_cast<size_t>(threads_), files_.size());
  while (pool_.size() + 1 < helpers &&
         add_thread(&pool_, [this](const std::stop_token& stop) { work(stop); })) {
  }
  changed_.notify_all();
}

CleanMesh PlyReadAhead::take(const std::string& path) {
  std::unique_lock lock(mutex_);
  const auto found = by_path_.find(path);
  if (found == by_path_.end()) {
    lock.unlock();
    return read_clean(path);
  }
  File& file = *found->second;
  while (file.state != File::State::kDone) {
    if (file.state == File::State::kWaiting) {
      read(&file, lock);
    } else if (File* other = next_to_read()) {  // rather than wait for the thread that has this one
      read(other, lock);
    } else {
      changed_.wait(lock);
    }
  }
  bytes_held_ -= std::exchange(file.bytes, 0);
  changed_.notify_all();
  if (file.failure) {
    try {
      std::rethrow_exception(file.failure);
    } catch (const std::bad_alloc&) {  // what others held then may be free now
      lock.unlock();
      return read_clean(path);
    }
  }
  return std::move(file.mesh);
}

PlyReadAhead::File* PlyReadAhead::next_to_read() {
  while (next_ < files_.size() && files_[next_].state != File::State::kWaiting) ++next_;
  return next_ < files_.size() && bytes_held_ < kMaxBytesHeld ? &files_[next_] : nullptr;
}

void PlyReadAhead::read(File* file, std::unique_lock<std::mutex>& lock) {
  file->state = File::State::kReading;
  lock.unlock();
  try {
    file->mesh = read_clean(file->path);
  } catch (...) {
    file->failure = std::current_exception();
  }
  lock.lock();
  file->bytes = bytes_of(file->mesh.mesh);
  bytes_held_ += file->bytes;
  file->state = File::State::kDone;
  changed_.notify_all();
}

void PlyReadAhead::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (File* file = next_to_read()) {
      read(file, lock);
    } else {
      changed_.wait(lock, stop, [this] { return next_to_read() != nullptr; });
    }
  }
}

}  // namespace lightmill
