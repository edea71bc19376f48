#pragma once
// A small OpenColorIO configuration, whose values can be worked out by hand.
#include <string>

namespace lightmill::testing {

/// Its displays are
///   Screen     Root: the square root of each channel; Swap: green, red, blue, halved; filmic: the same
///   Projector  Root: as Swap; View/2: as Swap
inline std::string ocio_config() {
  return R"(ocio_profile_version: 2
search_path: ""
strictparsing: true
roles:
  default: raw
  scene_linear: linear light
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  Projector:
    - !<View> {name: Root, colorspace: swapped}
    - !<View> {name: View/2, colorspace: swapped}
  Screen:
    - !<View> {name: Root, colorspace: root}
    - !<View> {name: Swap, colorspace: swapped}
    - !<View> {name: filmic, colorspace: swapped}
active_displays: [Screen, Projector]
active_views: []
colorspaces:
  - !<ColorSpace>
    name: raw
    isdata: true
  - !<ColorSpace>
    name: linear light
    aliases: [Linear Rec.709 (sRGB)]
    encoding: scene-linear
  - !<ColorSpace>
    name: root
    from_scene_reference: !<ExponentTransform> {value: 2, direction: inverse}
  - !<ColorSpace>
    name: swapped
    from_scene_reference: !<MatrixTransform> {matrix: [0, 0.5, 0, 0, 0.5, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
)";
}

}  // namespace lightmill::testing
