#pragma once
#include <string>

namespace lightmill {

/// 128 bits of the system's randomness in hex: a name that nothing else has. Not a secret.
std::string random_name();

}  // namespace lightmill
