#pragma once
// OpenColorIO configurations: the views that a studio looks at its pictures by.
//
//   const ColorConfig config("studio/config.ocio");
//   if (const auto view = config.find_view("ACES/Rec.709")) view->apply(image.data.data(), pixels);
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/rgb_primaries.h"
#include "common/image/image_library.h"

namespace lightmill {

/// A view of a configuration on one of its displays.
class ConfigView {
 public:
  /// From linear Rec.709 to the values that the display is sent, most of them in [0, 1]: in place,
  /// interleaved RGB. Thread-safe.
  void apply(float* rgb, size_t pixels) const;

 private:
  friend class ColorConfig;
  using Transform = std::unique_ptr<ColorTransform, void (*)(ColorTransform*)>;
  ConfigView(Transform transform, const std::optional<RgbMatrix>& first)
      : transform_(std::move(transform)), first_(first) {}
  Transform transform_;
  std::optional<RgbMatrix> first_;  // from Rec.709 to what the transform takes
};

class ColorConfig {
 public:
  /// Reads the file. Throws Error(kFailed) if it can't be read or is no configuration.
  explicit ColorConfig(const std::string& path);

  /// VIEW of the default display, or DISPLAY/VIEW; null if it has no such view. Throws Error(kFailed) if the
  /// view can't be made, as when a table of it is not there, or if no colour space of the configuration is
  /// known to be one that linear Rec.709 can be brought to.
  std::shared_ptr<const ConfigView> find_view(const std::string& name) const;
  /// All that find_view knows, those of the default display by VIEW alone: "Film, Raw, Projector/Film"; or
  /// "nothing".
  std::string view_list() const;

 private:
  using Config = std::unique_ptr<OpenColorConfig, void (*)(OpenColorConfig*)>;
  bool is_rec709(const std::string& space, const std::string& aces) const;
  std::string path_;
  ColorConfigContents contents_;
  Config config_{nullptr, nullptr};
};

/// The colour space of a configuration that our pixels go in by.
struct ConfigInput {
  std::string space;
  bool is_aces = false;  // it is ACES2065-1; else linear Rec.709
};
/// Whether the space is linear Rec.709, if the other is ACES2065-1.
using IsRec709 = std::function<bool(const std::string& space, const std::string& aces)>;
/// By the names and aliases that such spaces usually have, upper and lower case being one, and by the roles
/// scene_linear and aces_interchange. Throws Error(kFailed), naming the file as `path`, if there is none.
ConfigInput config_input(const ColorConfigContents& contents, const IsRec709& is_rec709,
                         const std::string& path);

}  // namespace lightmill
