#include "common/base/random_name.h"

#include <random>

namespace lightmill {

std::string random_name() {
  std::random_device random;
  std::string name;
  for (int i = 0; i < 32; ++i) name += "0123456789abcdef"[random() & 15u];
  return name;
}

}  // namespace lightmill
