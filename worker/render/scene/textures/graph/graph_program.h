#pragma once
// Texture graphs made ready to run: constants folded, results in few registers, one switch per operation and
// eight points.
#include <optional>
#include <vector>

#include "common/scene/texture_graph/texture_graph.h"
#include "worker/render/scene/textures/texture.h"

namespace lightmill {

/// Thread-safe, as it does not change.
class GraphProgram {
 public:
  /// `images` are the textures that its images are. Throws Error(kBadScene) if more values are wanted at once
  /// than there are registers.
  GraphProgram(const TextureGraph& graph, std::vector<int> images);

  /// Values that are not finite are 0. F is float, or Float8 of eight points.
  template <class F>
  void evaluate(const TextureTable& textures, const TexturePoint* at, F out[3]) const;
  /// If it is the same everywhere.
  std::optional<Rgb> constant() const;
  size_t operations() const { return graph_.operations.size(); }

 private:
  void fold();
  void assign_registers();

  static constexpr int kRegisters = 256;
  TextureGraph graph_;              // its operands are registers
  std::vector<int32_t> registers_;  // of results, by operation
  std::vector<int> images_;         // textures
};

}  // namespace lightmill
