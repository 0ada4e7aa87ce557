// CATIA V5.
//   $$*CATIA0, a name, three rows of four numbers: the machining axis system. The points are given in it. A
//   second one that differs would move the points of what follows against the program's frame in a way that
//   is documented nowhere that we know: refused. INDIRV/direction
//   TLON,GOFWD/(CIRCLE/center,radius),ON,(LINE/center,end): an arc in the plane across the tool axis that
//   starts in that direction. `ON,2,INTOF` counts the crossings of the line with the circle; the line's
//   second point is the end all the same.
#include <array>
#include <cmath>
#include <string>

#include "trunnion/base/number_text.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

constexpr double kSameCatiaPoint_mm = 5e-3;  // three decimals
constexpr double kAcross =
    1e-3;  // sine: a start direction that is more than this off the radius tells the sense

/// The numbers of a line; nothing when something else stands there.
std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> values;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(" \t", at)) != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(" \t", at), text.size());
    const ParsedNumber value = parse_number(text.substr(at, end - at));
    if (!value) return std::nullopt;
    values.push_back(value.value);
    at = end;
  }
  return values;
}

void take_matrix(Context& context) {
  Modal& modal = context.modal;
  const std::array<double, 12> m = modal.catia.matrix.values;
  const SourceRef where = modal.catia.matrix.where;
  modal.catia.matrix = {};
  if (context.options().frames == ReaderOptions::Frames::ignore) return;
  if (!modal.catia.first) {
    modal.catia.first = m;
    return;
  }
  for (std::size_t i = 0; i < m.size(); ++i) {
    const bool length = i % 4 == 3;
    if (std::abs(m[i] - (*modal.catia.first)[i]) > (length ? kSameCatiaPoint_mm : kAcross)) {
      return context.error(where,
                           "$$*CATIA0: a second machining axis system changes the geometry and is not "
                           "understood by this program");
    }
  }
}

void read_indirv(Context& context, const Statement& statement) {
  double value[3];
  if (statement.fields.size() != 3) return context.error(statement.where, "INDIRV: 3 values are needed");
  if (!context.numbers(statement, 0, 3, value)) return;
  const Vec3 direction(value[0], value[1], value[2]);
  if (!(direction.norm() > kAcross)) return context.error(statement.where, "INDIRV: it has no direction");
  context.modal.start_direction_A = direction.normalized();
}

/// `(CIRCLE/`x,y,z,r`)`,ON,[2,INTOF,]`(LINE/`x,y,z,x,y,z`)`: the ten numbers, brackets and words taken off.
std::optional<std::array<double, 10>> arc_numbers(Context& context, const Statement& statement) {
  std::array<double, 10> value{};
  std::size_t found = 0;
  bool counting = false;  // between ON and (LINE/: the number of a crossing
  for (const Field& field : statement.fields) {
    std::string_view text = field.text;
    if (text == "ON") {
      counting = true;
      continue;
    }
    if (const std::size_t slash = text.find_last_of('/'); slash != std::string_view::npos) {
      counting = false;
      text.remove_prefix(slash + 1);
    }
    while (!text.empty() && text.back() == ')') text.remove_suffix(1);
    if (counting || text == "INTOF") continue;
    const ParsedNumber number = parse_number(text);
    if (!number || found == value.size()) {
      context.error(field.where, "TLON: '" + std::string(field.text.substr(0, 40)) + "' is not understood");
      return std::nullopt;
    }
    value[found++] = number.value * context.modal.mm_per_unit;
  }
  if (found != value.size()) {
    context.error(
        statement.where,
        "TLON changes the geometry and is not understood by this program: a circle and a line are needed");
    return std::nullopt;
  }
  return value;
}

void read_tlon(Context& context, const Statement& statement) {
  Modal& modal = context.modal;
  const std::string_view text = statement.text;
  const bool known = text.starts_with(",GOFWD/(CIRCLE/") && text.find("(LINE/") != std::string_view::npos;
  if (!known)
    return context.error(statement.where, "TLON changes the geometry and is not understood by this program");
  const auto value = arc_numbers(context, statement);
  if (!value) return;
  if (!modal.has_position || !modal.start_direction_A) {
    return context.error(statement.where, "TLON: the start or its direction (INDIRV) is missing");
  }
  const std::array<double, 10>& v = *value;
  for (const double length : v) {
    if (!(std::abs(length) <= Context::kLongest_mm))
      return context.error(statement.where, "TLON: a length is out of range");
  }
  const Vec3 center(v[0], v[1], v[2]);
  const Vec3 line_start(v[4], v[5], v[6]);
  const Vec3 end(v[7], v[8], v[9]);
  if ((line_start - center).norm() > kSameCatiaPoint_mm) {
    return context.error(statement.where,
                         "TLON: the line does not begin at the circle's center: the end is not known");
  }
  const Vec3 radial = modal.tip_A - center;
  const double across =
      modal.axis_A.dot(radial.cross(*modal.start_direction_A)) / std::max(radial.norm(), kSameCatiaPoint_mm);
  if (std::abs(across) < kAcross) {
    return context.error(statement.where, "TLON: INDIRV points along the radius: the sense is not known");
  }
  PendingArc arc;
  arc.where = statement.where;
  arc.center_A = center;
  arc.normal_A = across > 0.0 ? modal.axis_A : Vec3(-modal.axis_A);
  arc.radius_mm = v[3];
  arc.full_when_closed = true;
  modal.start_direction_A.reset();
  modal.pending_arc = arc;
  finish_arc(context, statement.where, end, modal.axis_A);
}

constexpr WordReading kCatiaWords[] = {{"INDIRV", read_indirv}, {"TLON", read_tlon}};

}  // namespace

std::span<const WordReading> catia_words() {
  return kCatiaWords;
}

// CATIA names its operations in comments, `$$ OPERATION NAME : x`, `$$  End of generation of : x`, and gives
// its axis system there.
void read_comment(Context& context, const Statement& statement) {
  constexpr std::string_view kName = "OPERATION NAME :";
  CatiaMatrix& matrix = context.modal.catia.matrix;
  const std::string_view text = statement.text;
  if (text.find("CATIA") != std::string_view::npos) context.modal.origin.catia = true;
  if (matrix.lines > 0) {
    const auto values = numbers_of(text);
    if (values && values->size() == 4) {
      for (const double value : *values) matrix.values[matrix.count++] = value;
      if (matrix.count == matrix.values.size()) take_matrix(context);
      return;
    }
    if (matrix.count == 0 && matrix.lines == 1) {  // the name of the system
      ++matrix.lines;
      return;
    }
    context.error(statement.where, "$$*CATIA0: three lines of four numbers are needed");
    matrix = {};
  }
  if (text.starts_with("*CATIA0")) {
    matrix = {};
    matrix.where = statement.where;
    matrix.lines = 1;
  } else if (text.starts_with(kName)) {
    std::string_view name = text.substr(kName.size());
    name.remove_prefix(std::min(name.find_first_not_of(' '), name.size()));
    context.emit(statement.where, OperationBegin{shown_text(name)});
  } else if (text.starts_with("End of generation of :")) {
    context.emit(statement.where, OperationEnd{});
  }
}

}  // namespace trunnion::cl
