#include "coordinator/http_api/api_description.h"

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <stdexcept>

#include "lightmill/v1/http.pb.h"

namespace lightmill {
namespace {

constexpr const char* kTypeUrls = "type.googleapis.com";

}  // namespace

ApiDescription::ApiDescription(std::string_view bytes) {
  v1::HttpRoute::descriptor();  // links the option, so that it is known when the files are read
  google::protobuf::FileDescriptorSet files;
  if (!files.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    throw std::logic_error("the description of the protocol is damaged");
  for (const google::protobuf::FileDescriptorProto& file : files.file()) {
    const google::protobuf::FileDescriptor* const built = pool_.BuildFile(file);
    if (!built) throw std::logic_error("the protocol's file " + file.name() + " does not fit the others");
    for (int i = 0; i < built->service_count(); ++i) services_.push_back(built->service(i));
  }
  types_.reset(google::protobuf::util::NewTypeResolverForDescriptorPool(kTypeUrls, &pool_));
}

std::string ApiDescription::type_url(const google::protobuf::Descriptor& message) {
  return std::string(kTypeUrls) + "/" + message.full_name();
}

}  // namespace lightmill
