// OpenColorIO, as OpenImageIO wraps it.
#include <OpenImageIO/color.h>

#include <memory>

#include "common/image/openimageio/functions.h"

namespace lightmill {

struct OpenColorConfig {
  explicit OpenColorConfig(const std::string& path) : config(path) {}
  mutable OIIO::ColorConfig config;  // which keeps its errors in itself
};

struct ColorTransform {
  OIIO::ColorProcessorHandle processor;
};

namespace openimageio {
namespace {

std::string text_of(const char* name) { return name ? name : ""; }

ColorConfigContents contents_of(const OIIO::ColorConfig& config) {
  ColorConfigContents contents;
  for (const std::string& name : config.getColorSpaceNames())
    contents.spaces.push_back({name, config.getAliases(name)});
  for (const std::string& role : config.getRoles())
    contents.roles.emplace_back(role, text_of(config.getColorSpaceNameByRole(role)));
  for (const std::string& name : config.getDisplayNames())
    contents.displays.push_back({name, config.getViewNames(name)});
  contents.default_display = text_of(config.getDefaultDisplayName());
  return contents;
}

ColorTransform* made(const OpenColorConfig& config, const OIIO::ColorProcessorHandle& processor,
                     std::string* why) {
  if (processor) return new ColorTransform{processor};
  *why = config.config.geterror();
  return nullptr;
}

}  // namespace

OpenColorConfig* open_color_config(const std::string& path, ColorConfigContents* contents, std::string* why) {
  if (!OIIO::ColorConfig::supportsOpenColorIO()) {
    *why = "the OpenImageIO of this system was built without OpenColorIO";
    return nullptr;
  }
  auto opened = std::make_unique<OpenColorConfig>(path);
  // What it falls back to is not what was asked for.
  if (opened->config.has_error()) {
    *why = opened->config.geterror();
    return nullptr;
  }
  *contents = contents_of(opened->config);
  return opened.release();
}

void close_color_config(OpenColorConfig* config) { delete config; }

ColorTransform* make_conversion(const OpenColorConfig& config, const std::string& from, const std::string& to,
                                std::string* why) {
  return made(config, config.config.createColorProcessor(from, to), why);
}

ColorTransform* make_view(const OpenColorConfig& config, const std::string& space, const std::string& display,
                          const std::string& view, std::string* why) {
  return made(config, config.config.createDisplayTransform(display, view, space), why);
}

void free_color_transform(ColorTransform* transform) { delete transform; }

void apply_color_transform(const ColorTransform& transform, float* rgb, size_t pixels) {
  const auto step = static_cast<OIIO::stride_t>(3 * sizeof(float));
  transform.processor->apply(rgb, static_cast<int>(pixels), 1, 3, sizeof(float), step,
                             step * static_cast<OIIO::stride_t>(pixels));
}

}  // namespace openimageio
}  // namespace lightmill
