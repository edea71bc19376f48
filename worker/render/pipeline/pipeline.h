#pragma once
// Runs the stages in turn over one packet.
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill {

/// Renders `packet` with a thread's wavefront. Adds it to `builder` unless that is null.
void render_packet(const StageContext& context, const Packet& packet, int quantum_exponent,
                   Wavefront& wavefront, PartialBuilder* builder);

}  // namespace lightmill
