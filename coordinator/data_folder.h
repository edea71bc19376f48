#pragma once
// The coordinator's --data folder: made if absent, and held by one process at a time.
#include <string>

namespace lightmill {

class DataFolder {
 public:
  /// Throws Error(kFailed) if the folder can't be made or another coordinator holds it.
  explicit DataFolder(const std::string& path);
  ~DataFolder();
  DataFolder(const DataFolder&) = delete;
  DataFolder& operator=(const DataFolder&) = delete;
  std::string store_path() const { return path_ + "/jobs.sqlite"; }
  std::string quarantine_folder() const { return path_ + "/quarantine"; }
  std::string blob_folder() const { return path_ + "/blobs"; }

 private:
  std::string path_;
  int lock_fd_ = -1;  // the lock goes with the process, however it ends
};

/// Writes a small file so that a reader sees all of it or nothing. Throws Error(kFailed).
void write_file_atomically(const std::string& path, const std::string& content);

}  // namespace lightmill
