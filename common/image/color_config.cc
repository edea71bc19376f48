#include "common/image/color_config.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>

#include "common/base/error.h"
#include "common/base/lower_case.h"
#include "common/image/library_message.h"

namespace lightmill {

namespace {

// Names that mean nothing else: of the Color Interop Forum, the ACES configurations 2 and 1, and Blender.
constexpr const char* kRec709Names[] = {"lin_rec709_scene",
                                        "lin_rec709",
                                        "Linear Rec.709 (sRGB)",
                                        "Linear Rec.709",
                                        "Linear BT.709",
                                        "lin_rec709_srgb",
                                        "lin_srgb",
                                        "Linear sRGB",
                                        "Utility - Linear - sRGB",
                                        "Utility - Linear - Rec.709"};
constexpr const char* kAcesNames[] = {"lin_ap0_scene", "ACES2065-1", "ACES - ACES2065-1",
                                      "aces2065_1",    "lin_ap0",    "Linear ACES2065-1"};
constexpr const char kAcesRole[] = "aces_interchange", kSceneRole[] = "scene_linear";
// Rec.709 in older configurations; elsewhere it may be anything.
constexpr const char* kPlainNames[] = {"linear"};

/// The name of the first space that is called one of these.
std::optional<std::string> space_called(const ColorConfigContents& contents,
                                        std::span<const char* const> names) {
  for (const char* const name : names) {
    const auto is_it = [wanted = lower_case(name)](const std::string& own) {
      return lower_case(own) == wanted;
    };
    for (const ColorConfigContents::Space& space : contents.spaces) {
      if (is_it(space.name) || std::any_of(space.aliases.begin(), space.aliases.end(), is_it))
        return space.name;
    }
  }
  return std::nullopt;
}

std::optional<std::string> space_of_role(const ColorConfigContents& contents, const std::string& role) {
  for (const auto& [name, space] : contents.roles) {
    if (lower_case(name) == role && !space.empty()) return space;
  }
  return std::nullopt;
}

std::string quoted_list(std::span<const char* const> names) {
  std::string list;
  for (const char* const name : names) list.append(list.empty() ? "\"" : ", \"").append(name).append("\"");
  return list;
}

}  // namespace

ConfigInput config_input(const ColorConfigContents& contents, const IsRec709& is_rec709,
                         const std::string& path) {
  if (const auto space = space_called(contents, kRec709Names)) return {*space, false};
  auto aces = space_of_role(contents, kAcesRole);
  if (!aces) aces = space_called(contents, kAcesNames);
  const auto scene = space_of_role(contents, kSceneRole), plain = space_called(contents, kPlainNames);
  if (aces) {
    // Views of data show what goes in, so Rec.709 is better than ACES where a test can tell that it is that.
    for (const auto& space : {scene, plain}) {
      if (space && is_rec709(*space, *aces)) return {*space, false};
    }
    return {*aces, true};
  }
  if (scene && lower_case(*scene).find("709") != std::string::npos) return {*scene, false};
  if (plain) return {*plain, false};
  throw Error(ErrorKind::kFailed,
              path +
                  ": no colour space of it is known to be linear Rec.709; give that one the alias lin_rec709 "
                  "(looked for " +
                  quoted_list(kRec709Names) + ", the role " + kAcesRole + ", " + quoted_list(kAcesNames) +
                  ", the role " + kSceneRole + " with 709 in its name, " + quoted_list(kPlainNames) + ")");
}

void ConfigView::apply(float* rgb, size_t pixels) const {
  if (first_) {
    for (size_t i = 0; i < pixels; ++i) convert_color(*first_, rgb + 3 * i);
  }
  image_library().apply_color_transform(*transform_, rgb, pixels);
}

bool ColorConfig::is_rec709(const std::string& space, const std::string& aces) const {
  constexpr double kTolerance = 1e-3;  // files round their matrices
  const ImageLibrary& library = image_library();
  std::string why;
  const ConfigView::Transform transform(library.make_conversion(*config_, space, aces, &why),
                                        library.free_color_transform);
  if (!transform) return false;
  const RgbMatrix expected = *rgb_conversion(kRec709Primaries, kAp0Primaries);
  // A grey that is not 1 tells curves from matrices.
  constexpr float kLevels[] = {1, 0.125f};
  for (const float level : kLevels) {
    float rgb[9] = {level, 0, 0, 0, level, 0, 0, 0, level};
    library.apply_color_transform(*transform, rgb, 3);
    for (size_t i = 0; i < 9; ++i) {
      if (!(std::abs(rgb[i] - level * expected[i % 3][i / 3]) <= kTolerance)) return false;
    }
  }
  return true;
}

ColorConfig::ColorConfig(const std::string& path) : path_(path) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) {
    throw Error(ErrorKind::kFailed, path +
                                        ": there is no such file; name an OpenColorIO configuration, as "
                                        "studio/config.ocio");
  }
  std::string why;
  const ImageLibrary& library = image_library();
  config_ = Config(library.open_color_config(path, &contents_, &why), library.close_color_config);
  if (!config_) {
    throw Error(ErrorKind::kFailed,
                path + ": it can't be read as an OpenColorIO configuration: " + library_message(why));
  }
}

std::shared_ptr<const ConfigView> ColorConfig::find_view(const std::string& name) const {
  const auto is_named = [&](const ColorConfigContents::Display& display, const std::string& view) {
    return name == display.name + '/' + view || (display.name == contents_.default_display && name == view);
  };
  for (const ColorConfigContents::Display& display : contents_.displays) {
    for (const std::string& view : display.views) {
      if (!is_named(display, view)) continue;
      const ConfigInput input = config_input(
          contents_, [this](const auto& space, const auto& aces) { return is_rec709(space, aces); }, path_);
      std::string why;
      const ImageLibrary& library = image_library();
      ConfigView::Transform transform(library.make_view(*config_, input.space, display.name, view, &why),
                                      library.free_color_transform);
      if (!transform)
        throw Error(ErrorKind::kFailed, path_ + ": view \"" + name + "\": " + library_message(why));
      std::optional<RgbMatrix> first;
      if (input.is_aces) first = rgb_conversion(kRec709Primaries, kAp0Primaries);
      return std::shared_ptr<const ConfigView>(new ConfigView(std::move(transform), first));
    }
  }
  return nullptr;
}

std::string ColorConfig::view_list() const {
  std::string list;
  const auto add = [&](const ColorConfigContents::Display& display) {
    const bool usual = display.name == contents_.default_display;
    for (const std::string& view : display.views)
      list += (list.empty() ? "" : ", ") + (usual ? view : display.name + '/' + view);
  };
  for (const bool usual : {true, false}) {
    for (const ColorConfigContents::Display& display : contents_.displays) {
      if ((display.name == contents_.default_display) == usual) add(display);
    }
  }
  return list.empty() ? "nothing" : list;
}

}  // namespace lightmill
