#pragma once
// Blobs as FetchBlobs sends them: of each a header, then its bytes in chunks.
#include <string>
#include <vector>

#include "coordinator/service/streams/sending_call.h"
#include "coordinator/store/blob_store.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {

/// `blobs` must outlive the source. It throws StatusError: NOT_FOUND for a blob that is not there, DATA_LOSS
/// after the last chunk of one that is damaged.
MessageSource<v1::FetchBlobsResponse> blobs_as_messages(BlobStore& blobs, std::vector<std::string> digests);

}  // namespace lightmill
