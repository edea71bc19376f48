#pragma once
// Tables of photons, each of those of a block of cells of a grid.
#include <functional>
#include <vector>

#include "worker/render/guiding/next_event_guide.h"
#include "worker/render/guiding/photon.h"

namespace lightmill {

/// The box that a table's photons are followed to: their directions are those at the point of the box that is
/// nearest to the point that asks.
struct GuideBox {
  std::array<float, 3> centre{};
  float half = 0;  // half of its side
};
static_assert(sizeof(GuideBox) == 4 * sizeof(float));

/// A grid over where photons arrived.
struct PhotonGrid {
  LightGrid grid;
  std::vector<int32_t> table_of;  // per cell: number of its table, or -1
};

/// Every cell where photons arrived gets the table of the smallest block of cells around it, a power of two a
/// side, with at least `least` photons. `add` makes a table of the photons of a block. Tables are numbered in
/// the order of its calls.
PhotonGrid tabulate(const std::vector<Photon>& photons, size_t least,
                    const std::function<void(const std::vector<const Photon*>&, const GuideBox&)>& add);

}  // namespace lightmill
