#include "coordinator/store/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "common/base/error.h"

namespace lightmill {

DataFolder::DataFolder(const std::string& path, bool shared) : path_(path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error)
    throw Error(ErrorKind::kFailed, "--data " + path + ": can't make the folder: " + error.message());
  if (shared) {
    if (std::filesystem::exists(store_path(), error)) {
      throw Error(ErrorKind::kFailed, "--data " + path +
                                          " holds the jobs of a coordinator without --store; give a database "
                                          "another folder");
    }
    return;
  }
  if (std::filesystem::exists(path + "/" + kSharedStoreId, error)) {
    throw Error(ErrorKind::kFailed,
                "--data " + path +
                    " holds the files of a database; name it with --store, or give another "
                    "folder");
  }
  const std::string lock = path + "/lock";
  lock_fd_ = open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock_fd_ < 0) {
    throw Error(ErrorKind::kFailed, "--data " + path + " can't be written (" + lock + ": " +
                                        std::strerror(errno) +
                                        "); make it this user's, or give another folder");
  }
  if (flock(lock_fd_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_fd_);
    throw Error(ErrorKind::kFailed,
                "--data " + path + " is in use by another coordinator; stop it or give another folder");
  }
}

DataFolder::~DataFolder() {
  if (lock_fd_ >= 0) close(lock_fd_);
}

void write_file_atomically(const std::string& path, const std::string& content) {
  const std::string temporary = path + ".part";
  FILE* file = std::fopen(temporary.c_str(), "w");
  if (!file) throw Error(ErrorKind::kFailed, path + ": can't be written: " + std::strerror(errno));
  const bool written = std::fwrite(content.data(), 1, content.size(), file) == content.size();
  const bool closed = std::fclose(file) == 0;
  if (!written || !closed || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const std::string why = std::strerror(errno);
    std::remove(temporary.c_str());
    throw Error(ErrorKind::kFailed, path + ": can't be written: " + why);
  }
}

}  // namespace lightmill
