#include "common/image/image_space.h"

#include "common/base/error.h"

namespace lightmill {

namespace {

struct SpaceEntry {
  RgbPrimaries primaries;
  const char* interop_id;
};

// In the order of ImageSpace, as the names are.
constexpr SpaceEntry kSpaces[] = {{kRec709Primaries, "lin_rec709_scene"},
                                  {kAp1Primaries, "lin_ap1_scene"},
                                  {kAp0Primaries, "lin_ap0_scene"},
                                  {kRec2020Primaries, "lin_rec2020_scene"}};

const SpaceEntry& entry_of(ImageSpace space) { return kSpaces[static_cast<size_t>(space)]; }

}  // namespace

const std::vector<std::string>& image_space_names() {
  static const std::vector<std::string> names{"rec709", "acescg", "aces2065-1", "rec2020"};
  return names;
}

const std::string& image_space_name(ImageSpace space) {
  return image_space_names()[static_cast<size_t>(space)];
}

ImageSpace image_space_named(const std::string& name) {
  const auto& names = image_space_names();
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<ImageSpace>(i);
  }
  throw Error(ErrorKind::kUsage,
              "no colour space \"" + name + "\"; use rec709, acescg, aces2065-1 or rec2020");
}

const RgbPrimaries& primaries_of(ImageSpace space) { return entry_of(space).primaries; }

std::optional<ImageSpace> image_space_of(const RgbPrimaries& primaries) {
  for (size_t i = 0; i < std::size(kSpaces); ++i) {
    if (are_same(kSpaces[i].primaries, primaries)) return static_cast<ImageSpace>(i);
  }
  return std::nullopt;
}

const char* interop_id(ImageSpace space) { return entry_of(space).interop_id; }

}  // namespace lightmill
