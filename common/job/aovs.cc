#include "common/job/aovs.h"

#include <algorithm>
#include <bit>
#include <iterator>

#include "common/base/error.h"
#include "common/job/lobes.h"

namespace lightmill {
namespace {

struct Entry {
  Aovs aov;
  const char* name;
  const char* channels;  // a letter each
};
/// In the order of their bits.
constexpr Entry kEntries[] = {{kAovAlbedo, "albedo", "RGB"},
                              {kAovNormal, "normal", "XYZ"},
                              {kAovDepth, "depth", "Z"},
                              {kAovPosition, "position", "XYZ"},
                              {kAovAlpha, "alpha", "A"},
                              {kAovDirect, "direct", "RGB"},
                              {kAovIndirect, "indirect", "RGB"},
                              {kAovVariance, "variance", "RGB"},
                              {kAovSamples, "samples", "V"},
                              {kAovDifference, "difference", "RGB"},
                              {kAovLightGroups, "lightgroups", "RGB"},
                              {kAovCryptoObject, "cryptoobject", "rgba"},
                              {kAovCryptoMaterial, "cryptomaterial", "rgba"},
                              {kAovCryptoAsset, "cryptoasset", "rgba"},
                              {kAovUv, "uv", "UV"},
                              {kAovObjectId, "objectid", "V"},
                              {kAovMaterialId, "materialid", "V"},
                              {kAovDiffuseAlbedo, "diffusealbedo", "RGB"},
                              {kAovSpecularAlbedo, "specularalbedo", "RGB"},
                              {kAovMotion, "motion", "XY"},
                              {kAovLobes, "lobes", "RGB"}};
constexpr Aovs all_entries() {
  Aovs set = 0;
  for (const Entry& entry : kEntries) set |= entry.aov;
  return set;
}
static_assert(all_entries() == kAllAovs);

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
  for (const Entry& entry : kEntries) {
    if (!(set & entry.aov)) continue;
    if (!names.empty()) names += ',';
    names += entry.name;
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
      set |= found->aov;
    }
    begin = end + 1;
  }
  return set;
}

std::vector<std::string> aov_channels(Aovs set, const LightGroups& groups) {
  std::vector<std::string> channels;
  for (const Entry& entry : kEntries) {
    if (!(set & entry.aov)) continue;
    if (entry.aov == kAovAlpha) {
      channels.emplace_back("A");  // of the unnamed layer, beside R, G and B: what programs take for coverage
      continue;
    }
    if (entry.aov == kAovLightGroups) {
      for (const std::string& name : groups) append("lightgroup_" + name, entry.channels, &channels);
      for (const std::string& name : groups) {
        if (set & kAovDifference) append("lightgroup_" + name + "_difference", entry.channels, &channels);
      }
      continue;
    }
    if (entry.aov & kAovsOfCryptomatte) {
      // Small letters, as the specification has them and programs expect them.
      for (int layer = 0; layer < kMatteRanks / kRanksOfLayer; ++layer)
        append(matte_layer(entry.aov) + "0" + std::to_string(layer), entry.channels, &channels);
      continue;
    }
    if (entry.aov == kAovLobes) {
      for (const char* name : kLobeNames) append(name, entry.channels, &channels);
      continue;
    }
    append(entry.name, entry.channels, &channels);
    if (entry.aov != kAovDifference) continue;
    for (const Entry& half : kEntries) {
      if (set & kAovsOfHalves & half.aov)
        append(std::string(half.name) + "_difference", half.channels, &channels);
    }
  }
  return channels;
}

}  // namespace lightmill
