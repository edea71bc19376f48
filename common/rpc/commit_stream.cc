#include "common/rpc/commit_stream.h"

#include <algorithm>

#include "common/base/digest.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"

namespace lightmill {

grpc::Status commit_partial(v1::WorkerService::Stub& stub, grpc::ClientContext& context,
                            const std::string& worker, const LeaseKey& key, const std::string& partial_bytes,
                            v1::CommitResponse* response) {
  context.set_initial_metadata_corked(true);
  const auto writer = stub.Commit(&context, response);
  v1::CommitRequest message;
  v1::CommitRequest::Header& header = *message.mutable_header();
  header.set_worker_id(worker);
  *header.mutable_key() = to_proto(key);
  header.set_size(partial_bytes.size());
  header.set_digest(sha256_hex(partial_bytes));
  grpc::WriteOptions with_the_next;
  with_the_next.set_buffer_hint();
  bool open = writer->Write(message, with_the_next);
  for (size_t begin = 0; open && begin < partial_bytes.size(); begin += kChunkBytes) {
    message.set_chunk(partial_bytes.data() + begin, std::min(kChunkBytes, partial_bytes.size() - begin));
    grpc::WriteOptions options;
    if (begin + kChunkBytes >= partial_bytes.size()) options.set_last_message();
    open = writer->Write(message, options);
  }
  if (open && partial_bytes.empty()) writer->WritesDone();
  return writer->Finish();
}

}  // namespace lightmill
