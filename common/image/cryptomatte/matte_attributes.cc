#include "common/image/cryptomatte/matte_attributes.h"

#include <utility>

#include "common/image/cryptomatte/cryptomatte_hash.h"

namespace lightmill {

std::map<std::string, std::string> matte_attributes(const ImageReader& file,
                                                    const std::vector<std::string>& channels) {
  constexpr std::string_view kFirstLayer = "00.";  // "CryptoObject00.r"
  std::map<std::string, std::string> attributes;
  for (const std::string& channel : channels) {
    const size_t at = channel.rfind(kFirstLayer);
    if (at == std::string::npos || at == 0) continue;
    const std::string prefix = cryptomatte_prefix(channel.substr(0, at));
    for (const char* key : {"name", "hash", "conversion", "manifest"}) {
      if (std::string text = file.attribute(prefix + key); !text.empty())
        attributes[prefix + key] = std::move(text);
    }
  }
  return attributes;
}

}  // namespace lightmill
