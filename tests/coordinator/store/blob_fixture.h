#pragma once
// A store of blobs in a folder, and what disks do to it.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "coordinator/store/blob_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill::testing {

class BlobFixture : public ::testing::Test {
 protected:
  /// Stores it; returns its digest.
  std::string put(const std::string& content) {
    const std::string digest = sha256_hex(content);
    BlobStore::Writer writer = blobs.begin(digest, content.size());
    writer.write(content);
    writer.finish();
    return digest;
  }
  std::string file(const std::string& digest) const { return folder.file("blobs/" + digest); }
  /// Another content under the same name, as a disk may give it back. The file's times differ, whatever the
  /// resolution of the system's clock.
  void damage(const std::string& digest, const std::string& content) {
    std::ofstream(file(digest), std::ios::binary | std::ios::trunc) << content;
    std::filesystem::last_write_time(
        file(digest), std::filesystem::last_write_time(file(digest)) + std::chrono::hours(++hours_));
  }

  const TemporaryFolder folder;
  std::vector<std::string> logged;
  BlobStore blobs{folder.file("blobs"), [this](const std::string& line) { logged.push_back(line); }};

 private:
  int hours_ = 0;
};

}  // namespace lightmill::testing
