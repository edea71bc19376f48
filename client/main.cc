#include "client/cli.h"
#include "common/base/start_guard.h"

int main(int argc, char** argv) {
  lightmill::started();
  return lightmill::client::run_cli(argc, argv);
}
