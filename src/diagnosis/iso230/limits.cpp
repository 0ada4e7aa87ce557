#include <algorithm>
#include <charconv>
#include <cmath>

#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_limits.hpp"

namespace trunnion::iso230 {
namespace {

std::string name_of(const NamedNumber& number) {
  return number.of.empty() ? number.symbol : number.of + "." + number.symbol;
}

bool names(const NamedNumber& number, const NamedValue& value) {
  return number.symbol == value.symbol && (number.of.empty() || number.of == value.of);
}

Result<void> all_known(const std::vector<NamedNumber>& numbers, const std::vector<NamedValue>& values) {
  for (const NamedNumber& number : numbers) {
    if (std::any_of(values.begin(), values.end(), [&](const NamedValue& v) { return names(number, v); }))
      continue;
    std::vector<std::string> known;
    known.reserve(values.size());
    for (const NamedValue& v : values) known.push_back(number.of.empty() ? v.symbol : v.of + "." + v.symbol);
    return fail(ErrorCode::wrong_use,
                "these results have no value " + name_of(number) + did_you_mean(name_of(number), known));
  }
  return {};
}

// Nothing where none names it.
std::optional<double> number_for(const NamedValue& value, const std::vector<NamedNumber>& numbers) {
  const NamedNumber* found = nullptr;
  for (const NamedNumber& number : numbers) {
    if (!names(number, value)) continue;
    if (found == nullptr || found->of.empty() || !number.of.empty()) found = &number;
  }
  if (found == nullptr) return std::nullopt;
  return found->number * (value.angle ? kRadPerUrad : kMmPerUm);
}

Conformity conformity_of(const HeldValue& held) {
  if (!held.value.value) return Conformity::no_value;
  const double size = std::abs(*held.value.value);
  if (size + held.uncertainty <= held.limit) return Conformity::within;
  return size - held.uncertainty > held.limit ? Conformity::beyond : Conformity::undecided;
}

}  // namespace

std::vector<NamedValue> values_of(const std::vector<Positioning>& lines) {
  std::vector<NamedValue> out;
  for (const Positioning& line : lines) {
    const auto add = [&](const char* symbol, const std::optional<double>& value) {
      out.push_back({line.name, symbol, line.rotary, value});
    };
    const auto add_side = [&](const std::string& way, const std::optional<Unidirectional>& side) {
      add(("R_" + way).c_str(), side ? side->R : std::nullopt);
      add(("E_" + way).c_str(), side ? std::optional<double>(side->E) : std::nullopt);
      add(("A_" + way).c_str(), side ? side->A : std::nullopt);
    };
    add("A", line.A);
    add("R", line.R);
    add("E", line.E);
    add("M", line.M);
    add("B", line.B);
    add("B_mean", line.B_mean);
    add_side("up", line.up);
    add_side("down", line.down);
  }
  return out;
}

std::vector<NamedValue> values_of(const std::vector<CircularTest>& circles) {
  std::vector<NamedValue> out;
  for (const CircularTest& test : circles) {
    const auto add = [&](const char* symbol, const std::optional<double>& value) {
      out.push_back({test.plane, symbol, false, value});
    };
    const auto add_way = [&](const std::string& way, const std::optional<CircularTest::OneWay>& values) {
      if (!values) return;
      add(("G_" + way).c_str(), values->G);
      add(("F_max_" + way).c_str(), values->F_max);
      add(("F_min_" + way).c_str(), values->F_min);
    };
    add_way("clockwise", test.clockwise);
    add_way("counter_clockwise", test.counter_clockwise);
    add("G_b", test.G_b);
    add("D", test.D);
  }
  return out;
}

std::vector<NamedValue> values_of(const ErrorMotion& motion, const ErrorMotionValues& values) {
  const std::string of = motion.axis + " " + std::string(text_of(motion.kind)) + " " + motion.direction;
  const bool angle = motion.kind == ErrorMotionKind::tilt;
  std::vector<NamedValue> out = {{of, "total", angle, values.total},
                                 {of, "synchronous", angle, values.synchronous},
                                 {of, "asynchronous", angle, std::nullopt},
                                 {of, "residual_synchronous", angle, values.residual_synchronous}};
  if (values.turns > 1) out[2].value = values.asynchronous;
  return out;
}

Result<NamedNumber> parse_named_number(std::string_view text) {
  const std::size_t equals = text.rfind('=');
  const auto wrong = [&] {
    return fail(ErrorCode::wrong_use,
                "'" + std::string(text) + "' is not a symbol and a number above zero, as in A=10 or X.A=10");
  };
  if (equals == std::string_view::npos || equals == 0) return wrong();
  NamedNumber out;
  const std::string_view name = text.substr(0, equals);
  const std::size_t dot = name.rfind('.');
  out.of = dot == std::string_view::npos ? "" : std::string(name.substr(0, dot));
  out.symbol = dot == std::string_view::npos ? std::string(name) : std::string(name.substr(dot + 1));
  const std::string_view number = text.substr(equals + 1);
  const auto [end, code] = std::from_chars(number.data(), number.data() + number.size(), out.number);
  if (code != std::errc() || end != number.data() + number.size() || out.symbol.empty() ||
      !std::isfinite(out.number) || !(out.number > 0.0))
    return wrong();
  return out;
}

std::string_view text_of(Conformity conformity) {
  switch (conformity) {
    case Conformity::within:
      return "within";
    case Conformity::undecided:
      return "undecided";
    case Conformity::beyond:
      return "beyond";
    case Conformity::no_value:
      return "no value";
  }
  return "";
}

Result<std::vector<HeldValue>> hold_against(const std::vector<NamedValue>& values,
                                            const std::vector<NamedNumber>& limits,
                                            const std::vector<NamedNumber>& uncertainties) {
  if (const auto known = all_known(limits, values); !known) return tl::unexpected(known.error());
  if (const auto known = all_known(uncertainties, values); !known) return tl::unexpected(known.error());
  std::vector<HeldValue> out;
  for (const NamedValue& value : values) {
    const auto limit = number_for(value, limits);
    if (!limit) continue;
    HeldValue held{value, *limit, number_for(value, uncertainties).value_or(0.0), Conformity::no_value};
    held.conformity = conformity_of(held);
    out.push_back(std::move(held));
  }
  return out;
}

bool all_within(const std::vector<HeldValue>& held) {
  return std::all_of(held.begin(), held.end(),
                     [](const HeldValue& h) { return h.conformity == Conformity::within; });
}

}  // namespace trunnion::iso230
