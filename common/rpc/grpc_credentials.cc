#include "common/rpc/grpc_credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <mutex>

#include "common/base/error.h"
#include "common/base/file_stamp.h"

namespace lightmill {
namespace {

constexpr unsigned kRefreshSeconds = 1;

/// Adds the token to every call; a changed file is read again. If it can't be, the last token goes on.
class TokenPlugin : public grpc::MetadataCredentialsPlugin {
 public:
  explicit TokenPlugin(std::string path) : path_(std::move(path)), token_(read_token(path_)) {
    stamp_ = FileStamp::of(path_);
  }
  bool IsBlocking() const override { return false; }
  const char* GetType() const override { return "lightmill-token"; }
  grpc::Status GetMetadata(grpc::string_ref, grpc::string_ref, const grpc::AuthContext&,
                           std::multimap<std::string, std::string>* metadata) override {
    metadata->emplace("authorization", "Bearer " + current());
    return grpc::Status::OK;
  }

 private:
  std::string current() {
    const std::lock_guard lock(mutex_);
    const FileStamp now = FileStamp::of(path_);
    if (now == stamp_) return token_;
    try {
      token_ = read_token(path_);
      stamp_ = now;
    } catch (const Error&) {  // being replaced, or gone: the next call looks again
    }
    return token_;
  }

  const std::string path_;
  std::mutex mutex_;
  std::string token_;  // guarded by mutex_
  FileStamp stamp_;    // guarded by mutex_
};

std::shared_ptr<grpc::experimental::CertificateProviderInterface> watched(const SecurityFiles& files) {
  return std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(files.key, files.cert, files.ca,
                                                                              kRefreshSeconds);
}

}  // namespace

std::shared_ptr<grpc::ChannelCredentials> make_channel_credentials(const SecurityFiles& files) {
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_certificate_provider(watched(files));
  options.watch_root_certs();
  options.watch_identity_key_cert_pairs();
  return grpc::CompositeChannelCredentials(
      grpc::experimental::TlsCredentials(options),
      grpc::MetadataCredentialsFromPlugin(std::make_unique<TokenPlugin>(files.token)));
}

std::shared_ptr<grpc::ServerCredentials> make_server_credentials(const SecurityFiles& files) {
  grpc::experimental::TlsServerCredentialsOptions options(watched(files));
  options.watch_root_certs();
  options.watch_identity_key_cert_pairs();
  options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace lightmill
