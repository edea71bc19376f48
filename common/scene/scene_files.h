#pragma once
// The files of a scene: their names, and reading them whole within a bound.
#include <string>

namespace lightmill {

/// The name under which a reference is known in a bundle. A reference inside the scene's folder keeps its
/// lexically normalised form; any other (absolute, or reaching above the folder) becomes
/// "external/<16 hex digits of its SHA-256>/<file name>". It depends on the reference's text alone, so every
/// machine that reads the scene finds the same name.
std::string bundle_name(const std::string& reference);
/// True for what bundle_name can return: relative, normalised, no "..", no empty part, no control
/// characters, UTF-8.
bool is_safe_bundle_name(const std::string& name);

/// Empty if `path` is a regular file that can be opened for reading; else the reason.
std::string why_unreadable(const std::string& path);

/// Contents of a regular file; gzip'd contents (by magic number) are inflated. Throws Error(kBadScene) with a
/// message that says what is wrong (without the path) if it can't be read or is larger than `max_bytes`.
std::string read_scene_file(const std::string& path, size_t max_bytes);

}  // namespace lightmill
