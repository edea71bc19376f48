#pragma once
// How bright and how faint the image is, by a few of its camera paths.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Of the channels' values that are neither zero nor lost. Both are 0 if all were.
struct VisibleRange {
  float faint = 0;   // a sixteenth of them are fainter
  float bright = 0;  // the brightest
};

/// Traces about a thousand camera paths, spread over the film, with the strategies of `context`; with light
/// tracing, light paths too. The same on every machine of an arithmetic class.
VisibleRange measure_visible_range(const StageContext& context);

}  // namespace lightmill
