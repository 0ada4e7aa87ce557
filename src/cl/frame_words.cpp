#include <cmath>
#include <memory>
#include <string>

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

constexpr double kUnitLength =
    1e-3;  // axes of a frame are rounded unit vectors, at a right angle to each other

/// The rotation whose columns are x, y and x cross y, made orthogonal; nothing when x and y are no pair of
/// axes.
std::optional<Mat3> axes_of(const Vec3& x, const Vec3& y) {
  if (!(std::abs(x.norm() - 1.0) <= kUnitLength) || !(std::abs(y.norm() - 1.0) <= kUnitLength) ||
      !(std::abs(x.dot(y)) <= kUnitLength)) {
    return std::nullopt;
  }
  Mat3 R;
  R.col(0) = x.normalized();
  R.col(1) = (y - R.col(0) * R.col(0).dot(y)).normalized();
  R.col(2) = R.col(0).cross(R.col(1));
  return R;
}

// NX: MSYS/ox,oy,oz, xx,xy,xz, yx,yy,yz: the machine coordinate system in the absolute one, in which the
// points are given.
void read_msys(Context& context, const Statement& statement) {
  if (statement.fields.size() != 9) {
    return context.error(statement.where, "MSYS: " + std::to_string(statement.fields.size()) +
                                              " values; 9 (origin, x axis, y axis) are needed");
  }
  double v[9];
  if (!context.numbers(statement, 0, 9, v)) return;
  const auto R_AM = axes_of(Vec3(v[3], v[4], v[5]), Vec3(v[6], v[7], v[8]));
  if (!R_AM)
    return context.error(statement.where, "MSYS: its axes are not two unit vectors at a right angle");
  const Vec3 origin_A = Vec3(v[0], v[1], v[2]) * context.modal.mm_per_unit;
  if (!(origin_A.cwiseAbs().maxCoeff() <= Context::kLongest_mm)) {
    return context.error(statement.where,
                         "MSYS: its origin is beyond " + short_text(Context::kLongest_mm) + " mm");
  }
  if (!context.modal.first_msys && context.motion_count() > 0) {
    return context.error(statement.where,
                         "MSYS after the first motion: in which frame were the points before it?");
  }
  context.take_msys({statement.where, Pose{*R_AM, origin_A}});
}

// CSYS: three rows of four numbers, the columns are the axes and the origin.
std::optional<Pose> csys_of(Context& context, const Statement& statement) {
  double v[12];
  if (statement.fields.size() != 12) {
    context.error(statement.where, "CSYS: " + std::to_string(statement.fields.size()) +
                                       " values; 12 (three rows of four) are needed");
  } else if (context.numbers(statement, 0, 12, v)) {
    if (const auto R = axes_of(Vec3(v[0], v[4], v[8]), Vec3(v[1], v[5], v[9])))
      return Pose{*R, Vec3(v[3], v[7], v[11]) * context.modal.mm_per_unit};
    context.error(statement.where, "CSYS: its axes are not unit vectors at a right angle");
  }
  return std::nullopt;
}

// SolidWorks CAM. The points stay in the part's system (TRNTYP/WORLD) and carry their axis; the frame only
// says in which plane the operation is.
void read_csys(Context& context, const Statement& statement) {
  const auto pose = csys_of(context, statement);
  if (!pose) return;
  if (!same_pose(*pose, Pose::identity()) && !context.modal.origin.points_in_part) {
    context.warning_once(
        "CSYS", statement.where,
        "CSYS is not the identity: the points are taken as they stand, in the part's system, "
        "as TRNTYP/WORLD says it (there is none)");
  }
  const bool tilted = (pose->R.col(2) - Vec3::UnitZ()).norm() > kUnitLength;
  context.modal.tilted_csys_axis = tilted ? std::optional<Vec3>(pose->R.col(2)) : std::nullopt;
  context.emit(statement.where, Frame{"CSYS", std::make_shared<const Pose>(*pose), false});
}

// CAMplete and SURFCAM: MCS/x axis, y axis, z axis, origin: the frame of the operation in the work coordinate
// system. The points and tool axes behind it are given in it; where they have no axis, it is its z.
void read_mcs(Context& context, const Statement& statement) {
  if (statement.fields.size() != 12) {
    return context.error(statement.where, "MCS: " + std::to_string(statement.fields.size()) +
                                              " values; 12 (x axis, y axis, z axis, origin) are needed");
  }
  double v[12];
  if (!context.numbers(statement, 0, 12, v)) return;
  const auto R_PM = axes_of(Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5]));
  if (!R_PM || !((R_PM->col(2) - Vec3(v[6], v[7], v[8])).norm() <= kUnitLength)) {
    return context.error(statement.where,
                         "MCS: its axes are not three unit vectors at right angles, right-handed");
  }
  const Vec3 origin_P = Vec3(v[9], v[10], v[11]) * context.modal.mm_per_unit;
  if (!(origin_P.cwiseAbs().maxCoeff() <= Context::kLongest_mm)) {
    return context.error(statement.where,
                         "MCS: its origin is beyond " + short_text(Context::kLongest_mm) + " mm");
  }
  if (context.modal.first_msys || context.modal.new_msys)
    return context.error(statement.where, "MCS behind MSYS: two kinds of frames in one file");
  context.use_unit(statement.where);
  context.take_mcs(statement.where, Pose{*R_PM, origin_P});
}

void read_trntyp(Context& context, const Statement& statement) {
  bool world = statement.has_fields() && statement.fields[0].text == "WORLD";
  for (std::size_t i = 1; i < statement.fields.size(); ++i) {
    const auto offset = context.number(statement, i);
    if (!offset) return;
    world = world && *offset == 0.0;
  }
  if (!world) return context.error(statement.where, "TRNTYP: only TRNTYP/WORLD,0,0,0 is understood");
  context.modal.origin.points_in_part = true;
}

std::string unquoted(std::string_view text) {
  if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') text = text.substr(1, text.size() - 2);
  return std::string(text);
}

// SYN/'new','word'[,...]: from now on `new` stands for `word`. CATIA files for ICAM turn TLAXIS into a
// comment with it.
void read_syn(Context& context, const Statement& statement) {
  if (statement.fields.size() % 2 != 0 || !statement.has_fields()) {
    return context.error(statement.where, "SYN: pairs of words are needed");
  }
  for (std::size_t i = 0; i < statement.fields.size(); i += 2) {
    const std::string from = unquoted(statement.fields[i].text);
    const std::string to = unquoted(statement.fields[i + 1].text);
    if (from == "GOTO" || from == "FINI") {
      context.error(statement.fields[i].where, "SYN: " + from + " cannot be renamed");
    } else {
      context.modal.synonyms[from] = to;
    }
  }
}

// CAMplete, ZERO/n: the number of the work offset. One program is clamped once.
void read_zero(Context& context, const Statement& statement) {
  const auto number = context.whole(statement, 0);
  if (!number) return;
  auto& offset = context.modal.work_offset;
  if (offset && *offset != *number) {
    return context.error(statement.where, "ZERO/" + std::to_string(*number) + " behind ZERO/" +
                                              std::to_string(*offset) +
                                              ": a second clamping needs a program of its own");
  }
  offset = *number;
  context.warning_once(
      "ZERO", statement.where,
      "ZERO/" + std::to_string(*number) +
          " is not acted on: the work offset is that of the controller file or --work-offset");
}

// A subprogram of the control or of the post that the file was made for. What it does is not known.
void read_calsub(Context& context, const Statement& statement) {
  std::string name;
  for (const Field& field : statement.fields) name += (name.empty() ? "" : ",") + std::string(field.text);
  context.warning_once("CALSUB/" + name, statement.where,
                       "CALSUB/" + name.substr(0, 80) + ": the subprogram is not called");
}

constexpr WordReading kFrameWords[] = {{"MSYS", read_msys}, {"CSYS", read_csys},     {"MCS", read_mcs},
                                       {"ZERO", read_zero}, {"CALSUB", read_calsub}, {"TRNTYP", read_trntyp},
                                       {"SYN", read_syn}};

}  // namespace

std::span<const WordReading> frame_words() {
  return kFrameWords;
}

// Creo: `$$-> CSYS / 12 values`. Points are in the machine coordinate system already (the default of
// CL_DATA_MODE).
void read_directive(Context& context, const Statement& statement) {
  if (statement.word == "CUTTER" && statement.has_fields()) {
    const auto diameter = context.number(statement, 0);
    if (diameter) {
      context.modal.origin.mill = true;
      context.use_unit(statement.where);
      context.emit(statement.where,
                   ToolGeometry{*diameter * context.modal.mm_per_unit, std::nullopt, std::nullopt});
    }
    return;
  }
  if (statement.word == "FEATNO" && statement.has_fields()) {
    return context.emit(statement.where, OperationBegin{"FEATNO " + shown_text(statement.fields[0].text)});
  }
  if (statement.word == "END") return context.emit(statement.where, OperationEnd{});
  if (statement.word == "CUTCOM_GEOMETRY_TYPE" && statement.has_fields()) {
    context.modal.points_on_center = statement.fields[0].text == "OUTPUT_ON_CENTER";
  }
  if (statement.word != "CSYS") return;
  const auto pose = csys_of(context, statement);
  if (!pose) return;
  if (!same_pose(*pose, Pose::identity())) {
    context.warning_once("$$->CSYS", statement.where,
                         "$$-> CSYS is not the identity: the points are taken as they stand, in the machine "
                         "coordinate system");
  }
  context.emit(statement.where, Frame{"CSYS", std::make_shared<const Pose>(*pose), false});
}

}  // namespace trunnion::cl
