#include "worker/render/guiding/photon_guide.h"

#include "worker/render/guiding/photon_guide_table.h"

namespace lightmill {

PhotonGuide make_photon_guide(const std::vector<Photon>& photons) {
  PhotonGuide guide;
  PhotonGrid cells = tabulate(
      photons, PhotonGuide::kLobes,
      [&](const std::vector<const Photon*>& own, const GuideBox& box) { add_guide_table(own, box, &guide); });
  if (guide.boxes.empty()) return {};
  guide.grid = cells.grid;
  guide.table_of = std::move(cells.table_of);
  return guide;
}

}  // namespace lightmill
