#pragma once
// The blobs' part of `lightmill-coordinator --check`: looks, and changes nothing.
#include <string>
#include <vector>

namespace lightmill {

class BlobStore;
class JobStore;

/// Reads every blob, and looks whether each job that has not ended has all files of its scene. One line per
/// blob that is damaged and per job that lacks files; empty if there are none. Throws StoreError if the store
/// can't be read, Error(kFailed) if a file can't be read now.
std::vector<std::string> check_blobs(JobStore& store, BlobStore& blobs);

}  // namespace lightmill
