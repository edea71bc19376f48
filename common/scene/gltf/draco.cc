#include "common/scene/gltf/draco.h"

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>

namespace lightmill {
namespace {

/// glTF's number of a component type; 0 for what glTF does not have.
int component_type(draco::DataType type) {
  switch (type) {
    case draco::DT_INT8:
      return 5120;
    case draco::DT_UINT8:
      return 5121;
    case draco::DT_INT16:
      return 5122;
    case draco::DT_UINT16:
      return 5123;
    case draco::DT_UINT32:
      return 5125;
    case draco::DT_FLOAT32:
      return 5126;
    default:
      return 0;
  }
}

struct Size {
  uint32_t faces = 0, points = 0;
};

/// What the bytes say of their mesh's size, which the decoder takes memory by before it looks any further.
/// Throws GltfProblem for another version than the specification's (2.2).
Size claimed_size(const GltfValue& extension, std::string_view packed) {
  const auto damaged = [&] { extension.fail("its Draco mesh is damaged"); };
  draco::DecoderBuffer buffer;
  buffer.Init(packed.data(), packed.size());
  draco::DracoHeader header;
  if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok() ||
      header.encoder_type != draco::TRIANGULAR_MESH)
    damaged();
  if (header.version_major != 2 || header.version_minor != 2)
    extension.fail("its Draco mesh is of bitstream version " + std::to_string(header.version_major) + "." +
                   std::to_string(header.version_minor) + "; glTF's is 2.2: export it anew");
  buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(2, 2));
  if (header.flags & METADATA_FLAG_MASK) {
    draco::GeometryMetadata metadata;
    if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) damaged();
  }
  Size size;
  if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
    uint8_t traversal;
    if (!buffer.Decode(&traversal) || !draco::DecodeVarint(&size.points, &buffer) ||
        !draco::DecodeVarint(&size.faces, &buffer))
      damaged();
  } else if (!draco::DecodeVarint(&size.faces, &buffer) || !draco::DecodeVarint(&size.points, &buffer)) {
    damaged();
  }
  return size;
}

DracoMesh::Attribute values_of(const GltfValue& where, const draco::Mesh& mesh,
                               const draco::PointAttribute& attribute) {
  const int type = component_type(attribute.data_type());
  const size_t width = static_cast<size_t>(draco::DataTypeLength(attribute.data_type())) *
                       static_cast<size_t>(attribute.num_components());
  std::string bytes(width * mesh.num_points(), '\0');
  for (uint32_t i = 0; i < mesh.num_points(); ++i) {
    const draco::AttributeValueIndex value = attribute.mapped_index(draco::PointIndex(i));
    if (value.value() >= attribute.size()) where.fail("is damaged in the Draco mesh");
    attribute.GetValue(value, bytes.data() + width * i);
  }
  return {std::make_shared<const std::string>(std::move(bytes)), type, attribute.num_components(),
          attribute.normalized()};
}

}  // namespace

DracoMesh unpack_draco(const GltfValue& extension, std::string_view packed,
                       const std::function<void(size_t)>& charge) {
  const Size claimed = claimed_size(extension, packed);
  charge(3 * size_t{claimed.faces} + size_t{claimed.points});
  draco::DecoderBuffer buffer;
  buffer.Init(packed.data(), packed.size());
  auto decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok())
    extension.fail(std::string("its Draco mesh can't be unpacked: ") + decoded.status().error_msg());
  const draco::Mesh& mesh = *decoded.value();
  DracoMesh out;
  out.vertices = mesh.num_points();
  out.triangles.reserve(mesh.num_faces());
  for (uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const auto& face = mesh.face(draco::FaceIndex(f));
    const std::array<uint32_t, 3> t{face[0].value(), face[1].value(), face[2].value()};
    for (const uint32_t v : t) {
      if (v >= mesh.num_points()) extension.fail("its Draco mesh has a corner beyond its vertices");
    }
    out.triangles.push_back(t);
  }
  const GltfValue attributes = extension.require("attributes");
  for (const std::string& name : attributes.keys()) {
    const GltfValue id = attributes.require(name.c_str());
    const draco::PointAttribute* attribute =
        mesh.GetAttributeByUniqueId(static_cast<uint32_t>(id.integer(0, 0xffffffff)));
    const bool usable = attribute != nullptr && component_type(attribute->data_type()) != 0;
    if (!usable && name == "POSITION") id.fail("is no attribute of the Draco mesh that glTF can have");
    if (!usable) {
      id.mended("is no attribute of the Draco mesh that glTF can have; it is left out");
      continue;
    }
    charge(size_t{mesh.num_points()} * static_cast<size_t>(attribute->num_components()));
    out.attributes[name] = values_of(id, mesh, *attribute);
  }
  return out;
}

}  // namespace lightmill
