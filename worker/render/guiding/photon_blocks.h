#pragma once
// Tables of what photons tell, each of those of a block of cells of a grid.
#include <functional>
#include <vector>

#include "worker/render/guiding/next_event_guide.h"
#include "worker/render/guiding/photon.h"

namespace lightmill {

/// Where a table's photons are followed to: their directions are those at the point of this box next to the
/// point that asks.
struct GuideBox {
  std::array<float, 3> centre{};
  float half = 0;  // side
};
static_assert(sizeof(GuideBox) == 4 * sizeof(float));

/// A grid over where photons came to.
struct PhotonGrid {
  LightGrid grid;
  std::vector<int32_t> table_of;  // per cell: number of its table, or -1
};

/// Every cell that photons came to gets the table of the smallest block of cells around it, of a power of two
/// a side, with at least `least` of them. `add` makes a table of the photons of a block; tables are numbered
/// in the order of its calls.
PhotonGrid tabulate(const std::vector<Photon>& photons, size_t least,
                    const std::function<void(const std::vector<const Photon*>&, const GuideBox&)>& add);

}  // namespace lightmill
