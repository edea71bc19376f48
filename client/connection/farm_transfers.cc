// What goes to and from the farm in bulk: blobs of a scene and of a reference, and images.
#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <set>
#include <string_view>

#include "client/connection/farm_client.h"
#include "client/connection/farm_connection.h"
#include "client/connection/sequence_client.h"
#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/cryptomatte/cryptomatte_hash.h"
#include "common/rpc/convert.h"
#include "common/rpc/status.h"

namespace lightmill::client {
namespace {

static_assert(std::endian::native == std::endian::little, "images travel as little-endian floats");

constexpr size_t kDigestsAtOnce = 10000;
constexpr int kMaxAovChannels = 512;
constexpr size_t kMaxAttributeBytes = size_t{256} << 20;  // twice what names may make of it

/// The bytes of a blob to upload: a file, or memory.
class BlobBytes {
 public:
  BlobBytes(const std::string& path, std::string memory) : memory_(std::move(memory)) {
    if (path.empty()) return;
    file_.open(path, std::ios::binary);
    if (!file_) throw Error(ErrorKind::kFailed, path + ": cannot be read");
  }
  /// The next chunk; empty at the end.
  std::string next() {
    std::string chunk;
    if (file_.is_open()) {
      chunk.resize(kChunkBytes);
      file_.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
      chunk.resize(static_cast<size_t>(file_.gcount()));
    } else {
      chunk = memory_.substr(position_, kChunkBytes);
      position_ += chunk.size();
    }
    return chunk;
  }

 private:
  std::ifstream file_;
  std::string memory_;
  size_t position_ = 0;
};

struct PendingBlob {
  std::string digest;
  uint64_t size = 0;
  std::string path;  // empty: `memory` holds it
  std::string memory;
};

std::string pixel_bytes(const Image& image) {
  return {reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)};
}

/// Those that the coordinator lacks.
std::vector<PendingBlob> missing_of(FarmConnection& farm, std::vector<PendingBlob> blobs) {
  std::map<std::string, PendingBlob> by_digest;
  for (PendingBlob& blob : blobs) by_digest.emplace(blob.digest, std::move(blob));
  std::vector<std::string> digests;
  digests.reserve(by_digest.size());
  for (const auto& [digest, blob] : by_digest) digests.push_back(digest);
  std::vector<PendingBlob> missing;
  for (size_t first = 0; first < digests.size(); first += kDigestsAtOnce) {
    v1::FindMissingBlobsRequest request;
    for (size_t i = first; i < std::min(digests.size(), first + kDigestsAtOnce); ++i) {
      request.add_digests(digests[i]);
    }
    const auto response = farm.call(&v1::ClientService::Stub::FindMissingBlobs, request);
    for (const std::string& digest : response.digests()) {
      const auto found = by_digest.find(digest);
      if (found != by_digest.end()) missing.push_back(std::move(found->second));
    }
  }
  return missing;
}

void upload(FarmConnection& farm, const std::vector<PendingBlob>& blobs,
            const std::function<void(uint64_t sent)>& progress) {
  uint64_t sent = 0;
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::UploadBlobsResponse response;
  const auto writer = farm.stub()->UploadBlobs(&context, &response);
  bool open = true;
  for (const PendingBlob& blob : blobs) {
    if (!open) break;
    v1::UploadBlobsRequest message;
    message.mutable_header()->set_digest(blob.digest);
    message.mutable_header()->set_size(blob.size);
    open = writer->Write(message);
    BlobBytes bytes(blob.path, blob.memory);
    for (std::string chunk = bytes.next(); open && !chunk.empty(); chunk = bytes.next()) {
      sent += chunk.size();
      message.set_chunk(std::move(chunk));
      open = writer->Write(message);
      progress(sent);
    }
  }
  writer->WritesDone();
  farm.require_ok(writer->Finish());
}

std::vector<PendingBlob> blobs_of(const Bundle& bundle, const std::map<std::string, std::string>& paths) {
  std::vector<PendingBlob> blobs;
  for (const BundleEntry& entry : bundle.entries) {
    const auto path = paths.find(entry.digest);
    if (path == paths.end()) throw std::logic_error("a bundle entry without a file");
    blobs.push_back({entry.digest, entry.size, path->second, ""});
  }
  return blobs;
}

void upload_missing(FarmConnection& farm, std::vector<PendingBlob> blobs, const UploadProgress& uploading) {
  const std::vector<PendingBlob> missing = missing_of(farm, std::move(blobs));
  if (missing.empty()) return;
  uint64_t bytes = 0;
  for (const PendingBlob& blob : missing) bytes += blob.size;
  uploading(missing.size(), 0, bytes);
  upload(farm, missing, [&](uint64_t sent) { uploading(missing.size(), sent, bytes); });
}

}  // namespace

void upload_files(FarmConnection& farm, const std::vector<Bundle>& bundles,
                  const std::map<std::string, std::string>& paths, const UploadProgress& uploading) {
  std::vector<PendingBlob> blobs;
  std::set<std::string> known;
  for (const Bundle& bundle : bundles) {
    for (PendingBlob& blob : blobs_of(bundle, paths)) {
      if (known.insert(blob.digest).second) blobs.push_back(std::move(blob));
    }
  }
  upload_missing(farm, std::move(blobs), uploading);
}

JobId FarmClient::submit(const JobRequest& request, const std::map<std::string, std::string>& blob_paths,
                         const UploadProgress& uploading) {
  std::vector<PendingBlob> blobs = blobs_of(request.bundle, blob_paths);
  v1::SubmitJobRequest message;
  if (!request.reference.data.empty()) {
    std::string bytes = pixel_bytes(request.reference);
    v1::Reference& reference = *message.mutable_reference();
    reference.set_digest(sha256_hex(bytes));
    reference.set_width(request.reference.width);
    reference.set_height(request.reference.height);
    const uint64_t size = bytes.size();
    blobs.push_back({reference.digest(), size, "", std::move(bytes)});
  }
  upload_missing(*farm_, std::move(blobs), uploading);
  message.set_name(one_line(request.name));
  message.set_bundle_json(bundle_to_json(request.bundle));
  message.set_settings_json(settings_to_json(request.settings));
  message.set_priority(request.priority);
  message.set_pool(one_line(request.pool));
  message.set_submitter(one_line(request.submitter));
  message.set_max_workers(request.max_workers);
  message.set_deadline(request.deadline);
  for (const JobId& id : request.after) message.add_after(id.value);
  return JobId{farm_->call(&v1::ClientService::Stub::SubmitJob, message).job_id()};
}

FetchedImage FarmClient::fetch(const JobId& id, bool with_aovs, int max_side, bool for_display) {
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::FetchImageRequest request;
  request.set_job_id(id.value);
  request.set_with_aovs(with_aovs);
  request.set_max_side(max_side);
  request.set_for_display(for_display);
  const auto reader = farm_->stub()->FetchImage(&context, request);
  FetchedImage fetched;
  size_t filled = 0, size = 0, aov_size = 0, attribute_bytes = 0;
  v1::FetchImageResponse message;
  const auto malformed = [&] {
    return Error(ErrorKind::kFailed,
                 farm_->address() + " sent a malformed image; is it of the same version?");
  };
  const auto refuse = [&] {
    context.TryCancel();
    reader->Finish();
    throw malformed();
  };
  while (reader->Read(&message)) {
    if (message.has_header()) {
      const auto& header = message.header();
      if (size != 0 || header.width() < 1 || header.height() < 1 || header.channels() != 3 ||
          header.aov_channels_size() > kMaxAovChannels ||
          int64_t{header.width()} * header.height() > kMaxPixels) {
        refuse();
      }
      fetched.image = Image(header.width(), header.height(), 3);
      fetched.aovs.channels = {header.aov_channels().begin(), header.aov_channels().end()};
      if (header.aov_channels_size() > 0) {
        fetched.aovs.image = Image(header.width(), header.height(), header.aov_channels_size());
      }
      size = fetched.image.data.size() * sizeof(float);
      aov_size = fetched.aovs.image.data.size() * sizeof(float);
      fetched.metadata = {header.metadata().begin(), header.metadata().end()};
      continue;
    }
    if (message.has_attribute()) {
      const auto& attribute = message.attribute();
      attribute_bytes += attribute.name().size() + attribute.text().size();
      // A file's other attributes are ours to set.
      if (attribute_bytes > kMaxAttributeBytes || !attribute.name().starts_with(kMatteAttributes)) refuse();
      fetched.aovs.attributes[attribute.name()] += attribute.text();
      continue;
    }
    std::string_view chunk = message.chunk();
    if (chunk.size() > size + aov_size - filled) refuse();
    while (!chunk.empty()) {
      const bool colour = filled < size;
      char* to = colour ? reinterpret_cast<char*>(fetched.image.data.data()) + filled
                        : reinterpret_cast<char*>(fetched.aovs.image.data.data()) + (filled - size);
      const size_t count = colour ? std::min(chunk.size(), size - filled) : chunk.size();
      std::memcpy(to, chunk.data(), count);
      filled += count;
      chunk.remove_prefix(count);
    }
  }
  farm_->require_ok(reader->Finish());
  if (size == 0 || filled != size + aov_size) throw malformed();
  return fetched;
}

}  // namespace lightmill::client
