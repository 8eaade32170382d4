// The paper's experiment in 40 poses of each alternator, through the command line: tribin bench.
// usage: campaign_paper [options of tribin bench]

#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
  std::string command = TRIBIN_CLI " bench --poses 40";
  for (int i = 1; i < argc; ++i) command += std::string(" ") + argv[i];
  return std::system(command.c_str()) == 0 ? 0 : 1;
}
