#include "worker/agent/packet_renderer.h"

namespace lightmill::agent {
namespace {

class SceneRenderer : public PacketRenderer {
 public:
  SceneRenderer(const SceneDescription& scene, const RenderSettings& settings, int threads)
      : renderer_(scene, settings, threads) {}
  const FilmGrid& grid() const override { return renderer_.settings().grid; }
  int quantum_exponent() const override { return renderer_.quantum_exponent(); }
  bool has_camera_layer() const override { return renderer_.has_camera_layer(); }
  bool has_splat_layer() const override { return renderer_.has_splat_layer(); }
  std::unique_ptr<Workspace> make_workspace() const override { return renderer_.make_workspace(); }
  void render_packet(const Packet& packet, Workspace& workspace, PartialBuilder& builder) const override {
    renderer_.render_packet(packet, workspace, builder);
  }

 private:
  Renderer renderer_;
};

}  // namespace

std::shared_ptr<const PacketRenderer> make_packet_renderer(const SceneDescription& scene,
                                                           const RenderSettings& settings, int threads) {
  return std::make_shared<SceneRenderer>(scene, settings, threads);
}

}  // namespace lightmill::agent
