#include <iostream>

int main() {
  std::cerr << "tribin: not wired yet\n";
  return 2;
}
