#include "nc/reading/lexer.hpp"

namespace trunnion::nc {
namespace {

// Without trailing zeros behind the point.
Number trimmed(Number n) {
  while (n.decimals > 0 && n.mantissa % 10 == 0) {
    n.mantissa /= 10;
    --n.decimals;
  }
  return n;
}

}  // namespace

bool equal(Number a, Number b) {
  const Number x = trimmed(a);
  const Number y = trimmed(b);
  return x.mantissa == y.mantissa && x.decimals == y.decimals;
}

bool to_quanta_trimmed(Number number, int decimals, std::int64_t& out) {
  number = trimmed(number);
  return number.decimals <= decimals && to_quanta(number, decimals, out);
}

bool to_rounded_quanta(Number number, int decimals, std::int64_t& out) {
  if (to_quanta(number, decimals, out)) return true;
  if (number.decimals <= decimals) return false;
  const std::int64_t divisor = kPowersOfTen[static_cast<std::size_t>(number.decimals - decimals)];
  const std::int64_t half = number.mantissa < 0 ? -divisor / 2 : divisor / 2;
  out = (number.mantissa + half) / divisor;
  return true;
}

}  // namespace trunnion::nc
