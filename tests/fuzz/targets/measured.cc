// The reader of measured BSDFs.
#include <cstdlib>

#include "common/base/error.h"
#include "common/scene/measured/measured_table.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  try {
    const MeasuredTable m = parse_measured({reinterpret_cast<const char*>(data), size});
    const size_t views = m.phi.size() * m.theta.size();
    const auto fits = [](const MeasuredGrid& g, size_t slices) {
      const auto channels = static_cast<size_t>(g.channels);
      return g.width >= 2 && g.height >= 2 &&
             g.values.size() ==
                 slices * static_cast<size_t>(g.width) * static_cast<size_t>(g.height) * channels;
    };
    if (views == 0 || !fits(m.ndf, 1) || !fits(m.sigma, 1) || !fits(m.visible, views) ||
        !fits(m.luminance, views) || !fits(m.rgb, views))
      abort();
  } catch (const Error&) {
  }
  return 0;
}
