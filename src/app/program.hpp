#pragma once

namespace trunnion::app {

/// The program `trunnion`: one command, its exit code. Called once, by `main`.
int run_program(int argc, char** argv);

}  // namespace trunnion::app
