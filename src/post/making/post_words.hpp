#pragma once
#include <optional>
#include <string>

#include "trunnion/cl/record.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::post {

/// Words of the CL file that are meant for the post-processor: ROTABL, ROTATE, LIMITS, MAXDPM, CLEARP. Their
/// forms are those of PostWorks. Lengths come in mm, angles in degrees. What is not understood gives nothing.

/// LIMITS/CAXIS,min,max(,AAXIS,min,max ...): the travel that the program may use, within that of the machine
/// `given`. LIMITS/OFF: the machine's. False when the word is not understood; `cut` names an axis that has
/// less travel than that.
bool take_limits(const cl::PostWord& word, const Machine& given, Machine& machine, std::string& cut);

/// MAXDPM/n, rad/s: no rotary axis turns faster while cutting.
std::optional<double> rotary_limit_rad_s(const cl::PostWord& word);

/// CLEARP/XYPLAN,d  CLEARP/a,b,c,d: `normal . p = distance`.
struct ClearPlane {
  Vec3 normal_P = Vec3::UnitZ();  // unit
  double distance_mm = 0.0;
};
std::optional<ClearPlane> clear_plane_of(const cl::PostWord& word);

/// STANDS/A,26.5,C,147.6: of an NC program that is read as a path. Where the rotary axes of its machine stood
/// at the rapid that follows: of all positions that reach the path those nearest to it are chosen. Puts what
/// it says into `q`; false for any other word.
bool stands_at(const cl::PostWord& word, const Machine& machine, JointVector& q);
inline constexpr const char* kStands = "STANDS";

/// ROTABL/SHORT,COMBIN  LARGE  PLUS  AXIS,n: the local measure by which solutions are chosen from here on.
struct Measure {
  path::ChoiceMethod method = path::ChoiceMethod::combined;
  std::string axis;
};
std::optional<Measure> measure_of(const cl::PostWord& word, const Machine& machine);

/// ROTABL/(AXIS,n,)ATANGL,a(,CLW|CCLW|INCR)(,NOW|NEXT)  ROTABL/a,,TABLE,CLW  ROTATE/CAXIS,ATANGL,a: the axis
/// stands at `angle`, at once (and at the safe height) or with the next motion; the path goes on from there.
/// It decides about what is free: C at the pole, whole turns. CLW is the way of rising numbers.
struct TableTurn {
  AxisId axis = 0;
  double angle = 0.0;  // rad
  bool now = true;
};
std::optional<TableTurn> table_turn_of(const cl::PostWord& word, const Machine& machine,
                                       const JointVector& from);

/// ROTABL, ROTATE or STANDS that is no measure: behind it the tool comes from elsewhere than the last point.
bool may_turn_table(const cl::PostWord& word);

}  // namespace trunnion::post
