#pragma once
// The floating-point mode of every thread that builds or renders a scene.
#include <pmmintrin.h>
#include <xmmintrin.h>

namespace lightmill::agent {

/// Flush-to-zero and denormals-are-zero, round to nearest. Part of the arithmetic class: every thread that
/// touches a scene calls it, whatever mode it inherited, so that the bits can't depend on the thread.
inline void set_float_mode() {
  _MM_SET_ROUNDING_MODE(_MM_ROUND_NEAREST);
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}

}  // namespace lightmill::agent
