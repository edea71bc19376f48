#pragma once
// Tells whether a file has changed since it was read: by device, inode, size and time of change.
#include <sys/stat.h>

#include <string>

namespace lightmill {

struct FileStamp {
  dev_t device = 0;
  ino_t inode = 0;
  off_t size = -1;  // -1: there is no such file
  time_t seconds = 0;
  long nanoseconds = 0;
  bool operator==(const FileStamp&) const = default;

  static FileStamp of(const std::string& path) {
    struct stat s {};
    return ::stat(path.c_str(), &s) == 0 ? of(s) : FileStamp{};
  }
  /// Of an open file.
  static FileStamp of(int fd) {
    struct stat s {};
    return ::fstat(fd, &s) == 0 ? of(s) : FileStamp{};
  }

 private:
  static FileStamp of(const struct stat& s) {
    return {s.st_dev, s.st_ino, s.st_size, s.st_mtim.tv_sec, s.st_mtim.tv_nsec};
  }
};

}  // namespace lightmill
