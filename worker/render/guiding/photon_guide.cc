#include "worker/render/guiding/photon_guide.h"

#include "worker/render/guiding/photon_guide_table.h"

namespace lightmill {

CausticGuide make_caustic_guide(const std::vector<Photon>& photons) {
  CausticGuide guide;
  PhotonGrid cells = tabulate(
      photons, CausticGuide::kLobes,
      [&](const std::vector<const Photon*>& own, const GuideBox& box) { add_guide_table(own, box, &guide); });
  if (guide.boxes.empty()) return {};
  guide.grid = cells.grid;
  guide.table_of = std::move(cells.table_of);
  return guide;
}

}  // namespace lightmill
