#include "worker/agent/blob_cache.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"

namespace lightmill::agent {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail_disk(const std::string& path) {
  throw Error(ErrorKind::kFailed,
              path + ": " + std::strerror(errno) + "; free some disk space or choose another --cache-dir");
}

/// Writes fetched blobs to temporary files and renames those whose content fits their digest.
class Downloader : public BlobSink {
 public:
  Downloader(const std::string& folder, const std::map<std::string, BundleEntry>& wanted)
      : folder_(folder), wanted_(wanted) {}
  ~Downloader() override {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }

  void begin(const std::string& digest, uint64_t size) override {
    const auto found = wanted_.find(digest);
    if (found == wanted_.end() || size != found->second.size) {
      throw Damaged("the coordinator sent a blob that was not asked for, or of another size");
    }
    entry_ = found->second;
    left_ = size;
    hash_ = std::make_unique<Sha256>();
    temporary_ = folder_ + "/tmp." + std::to_string(::getpid()) + "." + digest;
    out_ = std::ofstream(temporary_, std::ios::binary | std::ios::trunc);
    if (!out_) fail_disk(temporary_);
  }
  void write(std::string_view chunk) override {
    if (!hash_ || chunk.size() > left_) {
      throw Damaged("blob " + entry_.digest + ": more bytes than announced");
    }
    left_ -= chunk.size();
    hash_->update(chunk);
    out_.write(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    if (!out_) fail_disk(temporary_);
  }
  void end() override {
    out_.close();
    if (!out_) fail_disk(temporary_);
    if (left_ != 0 || hash_->hex() != entry_.digest) {
      throw Damaged("blob " + entry_.digest + " (" + entry_.name +
                    ") arrived damaged: its content does not match its digest");
    }
    const std::string path = folder_ + "/" + blob_file_name(entry_);
    if (std::rename(temporary_.c_str(), path.c_str()) != 0) fail_disk(path);
    temporary_.clear();
    hash_.reset();
  }

 private:
  const std::string& folder_;
  const std::map<std::string, BundleEntry>& wanted_;
  BundleEntry entry_;
  uint64_t left_ = 0;
  std::unique_ptr<Sha256> hash_;
  std::string temporary_;
  std::ofstream out_;
};

}  // namespace

BlobCache::BlobCache(std::string folder, uint64_t max_bytes)
    : folder_(std::move(folder)), max_bytes_(max_bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error || ::access(folder_.c_str(), W_OK) != 0) {
    throw Error(ErrorKind::kFailed,
                folder_ + ": the cache folder can't be written to; choose another --cache-dir");
  }
}

bool BlobCache::is_present(const BundleEntry& entry) {
  const std::string name = blob_file_name(entry);
  const std::string path = folder_ + "/" + name;
  std::error_code error;
  if (fs::file_size(path, error) != entry.size || error) return false;
  if (!verified_.count(name)) {
    if (sha256_file(path) != entry.digest) {  // a damaged disk, or a crash in mid-write
      fs::remove(path, error);
      return false;
    }
    verified_.insert(name);
  }
  fs::last_write_time(path, fs::file_time_type::clock::now(), error);  // the clock of "least recently used"
  return true;
}

void BlobCache::make_room(const Bundle& bundle, uint64_t missing_bytes) {
  std::set<std::string> kept;
  for (const BundleEntry& entry : bundle.entries) kept.insert(blob_file_name(entry));
  struct Candidate {
    fs::path path;
    uint64_t size;
    fs::file_time_type used;
  };
  std::vector<Candidate> candidates;
  uint64_t total = missing_bytes;
  std::error_code error;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_, error)) {
    const uint64_t size = file.file_size(error);
    if (error) continue;  // another worker removed it just now
    total += size;
    if (!kept.count(file.path().filename()))
      candidates.push_back({file.path(), size, file.last_write_time(error)});
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.used < b.used; });
  for (const Candidate& candidate : candidates) {
    if (total <= max_bytes_) break;
    fs::remove(candidate.path, error);
    verified_.erase(candidate.path.filename());
    total -= std::min(total, candidate.size);
  }
}

void BlobCache::ensure(const Bundle& bundle, FarmLink& link) {
  std::map<std::string, BundleEntry> missing;
  uint64_t bundle_bytes = 0, missing_bytes = 0;
  for (const BundleEntry& entry : bundle.entries) {
    bundle_bytes += entry.size;
    if (is_present(entry)) continue;
    missing_bytes += entry.size;
    missing.emplace(entry.digest, entry);
  }
  if (bundle_bytes > max_bytes_) {
    throw Error(ErrorKind::kFailed, "the scene has " + std::to_string(bundle_bytes) +
                                        " bytes and the cache holds " + std::to_string(max_bytes_) +
                                        "; raise this worker's --cache-size");
  }
  if (missing.empty()) return;
  make_room(bundle, missing_bytes);
  std::vector<std::string> digests;
  digests.reserve(missing.size());
  for (const auto& [digest, entry] : missing) digests.push_back(digest);
  Downloader downloader(folder_, missing);
  link.fetch_blobs(digests, downloader);
  // One content may go by several names with different extensions: each is a file of its own.
  for (const BundleEntry& entry : bundle.entries) {
    const auto fetched = missing.find(entry.digest);
    if (fetched == missing.end()) continue;
    const std::string name = blob_file_name(entry), source = blob_file_name(fetched->second);
    std::error_code error;
    if (name != source) {
      fs::copy_file(folder_ + "/" + source, folder_ + "/" + name, fs::copy_options::overwrite_existing,
                    error);
    }
    if (error || !fs::exists(folder_ + "/" + name, error)) {
      throw Error(ErrorKind::kFailed, "blob " + entry.digest + " (" + entry.name + ") could not be stored");
    }
    verified_.insert(name);
  }
}

std::string BlobCache::find(const std::string& digest) const {
  std::error_code error;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_, error)) {
    if (file.path().filename().string().starts_with(digest)) return file.path();
  }
  return {};
}

}  // namespace lightmill::agent
