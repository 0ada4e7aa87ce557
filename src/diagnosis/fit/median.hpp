#pragma once
#include "trunnion/base/median.hpp"
