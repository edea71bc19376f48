#include "client/cli.h"

int main(int argc, char** argv) { return lightmill::client::run_cli(argc, argv); }
