#include "worker/render/scene/materials/measured_builder.h"

#include <algorithm>
#include <bit>
#include <map>

#include "common/base/error.h"
#include "common/scene/measured/measured_table.h"
#include "worker/render/bsdf/measured_warp.h"

namespace lightmill {
namespace {

/// Places are 32-bit integers, and a parameter, a float, holds 24 bits of the head's.
constexpr size_t kMostFloats = size_t{kMeasuredUnit} << 24;

class Writer {
 public:
  Writer(const MeasuredTable& table, std::vector<float>* out) : table_(table), out_(*out) {}

  float write() {
    out_.resize((out_.size() + kMeasuredUnit - 1) / kMeasuredUnit * kMeasuredUnit);
    const size_t head = out_.size();
    head_ = head;
    if (head + needed() >= kMostFloats)
      throw Error(ErrorKind::kBadScene, "the measured BSDFs of the scene take more than 4 GB; use fewer");
    out_.resize(head + kMeasuredUnit);
    set(kMeasuredPhiCount, table_.phi.size());
    set(kMeasuredThetaCount, table_.theta.size());
    set(kMeasuredIsotropic, table_.isotropic());
    set(kMeasuredPhiAt, append(table_.phi));
    set(kMeasuredThetaAt, append(table_.theta));
    add_flat(kMeasuredNdf, table_.ndf);
    add_flat(kMeasuredSigma, table_.sigma);
    add_density(kMeasuredVisible, table_.visible);
    add_density(kMeasuredLuminance, table_.luminance);
    set(kMeasuredRgbAt, append(table_.rgb.values));
    const size_t first_unit = head / kMeasuredUnit;
    return static_cast<float>(first_unit);
  }

 private:
  size_t needed() const {
    const MeasuredTable& t = table_;
    return kMeasuredUnit + t.phi.size() + t.theta.size() + t.ndf.values.size() + t.sigma.values.size() +
           3 * (t.visible.values.size() + t.luminance.values.size()) + t.rgb.values.size();
  }
  void set(int slot, size_t value) {
    out_[head_ + static_cast<size_t>(slot)] = std::bit_cast<float>(static_cast<int32_t>(value));
  }
  size_t append(const std::vector<float>& values) {
    const size_t at = out_.size();
    out_.insert(out_.end(), values.begin(), values.end());
    return at;
  }
  void add_size(int slot, const MeasuredGrid& grid) {
    set(slot, static_cast<size_t>(grid.width));
    set(slot + 1, static_cast<size_t>(grid.height));
  }
  void add_flat(int slot, const MeasuredGrid& grid) {
    add_size(slot, grid);
    set(slot + 2, append(grid.values));
  }

  /// Values scaled to an integral of 1 over the square, the integrals of each row up to a node, and those of
  /// the rows up to a row.
  void add_density(int slot, const MeasuredGrid& grid) {
    add_size(slot, grid);
    const auto width = static_cast<size_t>(grid.width), height = static_cast<size_t>(grid.height);
    const size_t nodes = width * height, slices = grid.values.size() / nodes;
    std::vector<float> values(grid.values.size()), conditional(grid.values.size()), marginal(slices * height);
    std::vector<double> in(nodes), across(nodes), down(height);
    for (size_t slice = 0; slice < slices; ++slice) {
      std::copy_n(grid.values.begin() + static_cast<std::ptrdiff_t>(slice * nodes), nodes, in.begin());
      if (!(sum_up(in, width, &across, &down) > 0)) {
        in.assign(nodes, 1);
        sum_up(in, width, &across, &down);
      }
      const double scale = 1 / down.back();
      for (size_t i = 0; i < nodes; ++i) {
        values[slice * nodes + i] = static_cast<float>(in[i] * scale);
        conditional[slice * nodes + i] = static_cast<float>(across[i] * scale);
      }
      for (size_t y = 0; y < height; ++y) marginal[slice * height + y] = static_cast<float>(down[y] * scale);
    }
    set(slot + 2, append(values));
    set(slot + 3, append(conditional));
    set(slot + 4, append(marginal));
  }
  /// Integrals of the rows up to each node, and over the rows; returns that over the square.
  static double sum_up(const std::vector<double>& in, size_t width, std::vector<double>* across,
                       std::vector<double>* down) {
    const size_t height = down->size();
    for (size_t y = 0; y < height; ++y) {
      double sum = 0;
      for (size_t x = 0; x < width; ++x) {
        const size_t i = y * width + x;
        if (x > 0) sum += (in[i - 1] + in[i]) / static_cast<double>(2 * (width - 1));
        (*across)[i] = sum;
      }
    }
    double sum = 0;
    for (size_t y = 0; y < height; ++y) {
      const size_t end = y * width + width - 1;
      if (y > 0) sum += ((*across)[end - width] + (*across)[end]) / static_cast<double>(2 * (height - 1));
      (*down)[y] = sum;
    }
    return sum;
  }

  const MeasuredTable& table_;
  std::vector<float>& out_;
  size_t head_ = 0;
};

}  // namespace

void add_measured(const std::vector<MaterialDescription>& materials, RenderScene* scene) {
  std::map<const MeasuredTable*, float> places;
  for (size_t i = 0; i < materials.size(); ++i) {
    const auto* measured = std::get_if<MeasuredMaterial>(&materials[i].kind);
    if (!measured || !measured->table) continue;
    const auto [at, is_new] = places.try_emplace(measured->table.get());
    if (is_new) at->second = Writer(*measured->table, &scene->bsdf_tables).write();
    scene->material_params[i * kBsdfParams] = at->second;
  }
}

}  // namespace lightmill
