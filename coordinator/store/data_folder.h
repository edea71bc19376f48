#pragma once
// The coordinator's --data folder, made if absent. With the job store in it, one process at a time holds it.
// Beside a database, coordinators share it, and the database says which of them leads.
#include <string>

namespace lightmill {

/// A file of a shared folder. It names the database that the folder goes with.
inline constexpr const char* kSharedStoreId = "store-id";

class DataFolder {
 public:
  /// Throws Error(kFailed) if the folder can't be made, another coordinator holds it, or its jobs are in the
  /// other kind of store.
  explicit DataFolder(const std::string& path, bool shared = false);
  ~DataFolder();
  DataFolder(const DataFolder&) = delete;
  DataFolder& operator=(const DataFolder&) = delete;
  std::string store_path() const { return path_ + "/jobs.sqlite"; }
  std::string quarantine_folder() const { return path_ + "/quarantine"; }
  std::string hook_secret_path() const { return path_ + "/hook-secret"; }
  std::string blob_folder() const { return path_ + "/blobs"; }
  std::string thumbnail_folder() const { return path_ + "/thumbnails"; }

 private:
  std::string path_;
  int lock_fd_ = -1;  // of one that is not shared; the lock goes with the process, however it ends
};

/// Writes a small file so that a reader sees all of it or nothing. Throws Error(kFailed).
void write_file_atomically(const std::string& path, const std::string& content);

}  // namespace lightmill
