#pragma once
#include "trunnion/effects/effect.hpp"
