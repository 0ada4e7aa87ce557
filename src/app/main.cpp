#include "app/program.hpp"

int main(int argc, char** argv) {
  return trunnion::app::run_program(argc, argv);
}
