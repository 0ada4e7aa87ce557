#pragma once
#include "post/making/program_in_work.hpp"

namespace trunnion::post {

/// What there is to say of the chunk in work near the pole.
void tell_pole(ProgramInWork& work);

/// The tilted plane in which the chunk in work is to be written, when it is one of its kind. 3+2: all motions
/// of the run have one tool axis and one position of the rotary axes. Planes are entered where the run begins
/// with a rapid or from a safe position.
void choose_plane(ProgramInWork& work);

}  // namespace trunnion::post
