#pragma once
// How linear radiance becomes the colours of a screen: exposure, a tone curve and the sRGB encoding, or a
// view of an OpenColorIO configuration.
#include <memory>
#include <optional>
#include <string>

namespace lightmill {

class ConfigView;

/// kSrgb     clips at 1: exact for what lies below it
/// kFilmic   John Hable's curve ("Filmic Tonemapping Operators", 2010): A .15, B .50, C .10, D .20, E .02, F
/// .30,
///           white at 11.2, exposure bias 2
/// kAces     Krzysztof Narkowicz's fit of the ACES reference curves ("ACES Filmic Tone Mapping Curve", 2015),
/// by
///           channel, with the exposure of 0.6 that he names for the look of the original
/// kNone     clips at 1 and encodes nothing: for data, not for looking at
enum class ViewCurve { kSrgb, kFilmic, kAces, kNone };

struct ViewTransform {
  ViewCurve curve = ViewCurve::kSrgb;
  double exposure = 0;                                    // stops: values are multiplied by 2^exposure first
  std::shared_ptr<const ConfigView> of_config = nullptr;  // in place of the curve
  bool operator==(const ViewTransform&) const = default;
};

/// "srgb, filmic, aces or none"; throws Error(kUsage) for any other name.
ViewCurve view_curve_named(const std::string& name);
std::optional<ViewCurve> find_view_curve(const std::string& name);
/// The encoded value in [0, 1]; 0 for NaN and what is not positive. By the curve: a configuration's views
/// need all channels.
float view_value(float linear, const ViewTransform& view);
/// Encoded values in [0, 1] of interleaved pixels of `channels` values, into `out`. 0 for NaN. Throws
/// std::logic_error where a configuration's view gets pixels that are not RGB.
void view_pixels(const float* linear, size_t pixels, int channels, const ViewTransform& view, float* out);

}  // namespace lightmill
