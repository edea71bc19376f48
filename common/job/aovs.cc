#include "common/job/aovs.h"

#include <algorithm>
#include <bit>
#include <iterator>

#include "common/base/error.h"

namespace lightmill {
namespace {

struct Entry {
  const char* name;
  const char* channels;  // a letter each
};
constexpr Entry kEntries[] = {{"albedo", "RGB"},          {"normal", "XYZ"},      {"depth", "Z"},
                              {"position", "XYZ"},        {"alpha", "A"},         {"direct", "RGB"},
                              {"indirect", "RGB"},        {"variance", "RGB"},    {"samples", "V"},
                              {"difference", "RGB"},      {"lightgroups", "RGB"}, {"cryptoobject", "rgba"},
                              {"cryptomaterial", "rgba"}, {"cryptoasset", "rgba"}};
static_assert((1u << std::size(kEntries)) - 1 == kAllAovs);

void append(const std::string& layer, const char* letters, std::vector<std::string>* channels) {
  for (const char* letter = letters; *letter; ++letter)
    channels->emplace_back(layer).append(1, '.').append(1, *letter);
}

/// In the order of their bits.
constexpr const char* kMatteLayers[] = {"CryptoObject", "CryptoMaterial", "CryptoAsset"};
constexpr int kRanksOfLayer = 2;  // an id and a coverage each

}  // namespace

std::string matte_layer(Aovs matte) {
  return kMatteLayers[std::countr_zero(matte) - std::countr_zero(kAovCryptoObject)];
}

bool is_matte_channel(const std::string& channel) {
  return std::any_of(std::begin(kMatteLayers), std::end(kMatteLayers), [&](const std::string& layer) {
    return channel.starts_with(layer) && channel.find('.') == layer.size() + 2;
  });
}

std::string aov_names(Aovs set) {
  std::string names;
  for (unsigned i = 0; i < std::size(kEntries); ++i) {
    if (!(set >> i & 1)) continue;
    if (!names.empty()) names += ',';
    names += kEntries[i].name;
  }
  return names;
}

Aovs aovs_named(const std::string& names) {
  Aovs set = 0;
  for (size_t begin = 0; begin < names.size();) {
    const size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = names.substr(begin, end - begin);
    const auto* found = std::find_if(std::begin(kEntries), std::end(kEntries),
                                     [&](const Entry& e) { return name == e.name; });
    if (name == "all") {
      set = kAllAovs;
    } else if (name == "denoise") {
      set |= kAovsToDenoise;
    } else if (name == "cryptomatte") {
      set |= kAovsOfCryptomatte;
    } else if (found == std::end(kEntries)) {
      throw Error(ErrorKind::kUsage, "no AOV \"" + name + "\" in \"" + names + "\"; there are " +
                                         aov_names(kAllAovs) + ", denoise, cryptomatte and all");
    } else {
      set |= 1u << (found - std::begin(kEntries));
    }
    begin = end + 1;
  }
  return set;
}

std::vector<std::string> aov_channels(Aovs set, const LightGroups& groups) {
  std::vector<std::string> channels;
  for (unsigned i = 0; i < std::size(kEntries); ++i) {
    if (!(set >> i & 1)) continue;
    if (1u << i == kAovAlpha) {
      channels.emplace_back("A");  // of the unnamed layer, beside R, G and B: what programs take for coverage
      continue;
    }
    const Entry& entry = kEntries[i];
    if (1u << i == kAovLightGroups) {
      for (const std::string& name : groups) append("lightgroup_" + name, entry.channels, &channels);
      for (const std::string& name : groups) {
        if (set & kAovDifference) append("lightgroup_" + name + "_difference", entry.channels, &channels);
      }
      continue;
    }
    if (1u << i & kAovsOfCryptomatte) {
      // Small letters, as the specification has them and programs expect them.
      for (int layer = 0; layer < kMatteRanks / kRanksOfLayer; ++layer)
        append(matte_layer(1u << i) + "0" + std::to_string(layer), entry.channels, &channels);
      continue;
    }
    append(entry.name, entry.channels, &channels);
    if (1u << i != kAovDifference) continue;
    for (unsigned j = 0; j < i; ++j) {
      if (set & kAovsOfHalves & (1u << j))
        append(std::string(kEntries[j].name) + "_difference", kEntries[j].channels, &channels);
    }
  }
  return channels;
}

}  // namespace lightmill
