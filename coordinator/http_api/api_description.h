#pragma once
// What the protocol says of itself: the files of proto/ with their comments, as protoc described them when
// the program was built. Routes, transcoding and the OpenAPI text are made from it.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/type_resolver.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// A google.protobuf.FileDescriptorSet with source info; embedded by coordinator/CMakeLists.txt.
std::string_view embedded_description();

/// Thread-safe once it is made.
class ApiDescription {
 public:
  /// Throws std::logic_error if the bytes are no set of files that fit together.
  explicit ApiDescription(std::string_view bytes = embedded_description());

  /// In the order of the files.
  const std::vector<const google::protobuf::ServiceDescriptor*>& services() const { return services_; }
  /// Of all messages, for protobuf's JSON.
  google::protobuf::util::TypeResolver* types() const { return types_.get(); }
  /// How the resolver calls a message.
  static std::string type_url(const google::protobuf::Descriptor& message);

 private:
  google::protobuf::DescriptorPool pool_;
  std::vector<const google::protobuf::ServiceDescriptor*> services_;
  std::unique_ptr<google::protobuf::util::TypeResolver> types_;
};

/// What the .proto file says before `thing` or behind it, as one text; lines of a paragraph are joined.
template <class Descriptor>
std::string comment_of(const Descriptor& thing) {
  google::protobuf::SourceLocation at;
  if (!thing.GetSourceLocation(&at)) return "";
  const std::string& text = at.leading_comments.empty() ? at.trailing_comments : at.leading_comments;
  std::string joined;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = std::string_view(text).substr(begin, end - begin);
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    if (!joined.empty() && !joined.ends_with('\n')) joined += line.empty() ? "\n" : " ";
    joined += line;
    begin = end + 1;
  }
  joined.erase(joined.find_last_not_of(" \n") + 1);
  return joined;
}

}  // namespace lightmill
