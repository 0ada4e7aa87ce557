#include "nc/digits.hpp"

#include "trunnion/base/contract.hpp"

namespace trunnion::nc {
namespace {

char* put_magnitude(char* p, std::uint64_t magnitude, int decimals) {
  switch (decimals) {
    case 1:
      return put_point_number<1>(p, magnitude);
    case 2:
      return put_point_number<2>(p, magnitude);
    case 3:
      return put_point_number<3>(p, magnitude);
    case 4:
      return put_point_number<4>(p, magnitude);
    case 5:
      return put_point_number<5>(p, magnitude);
    case 6:
      return put_point_number<6>(p, magnitude);
    case 7:
      return put_point_number<7>(p, magnitude);
    case 8:
      return put_point_number<8>(p, magnitude);
    case 9:
      return put_point_number<9>(p, magnitude);
    default:
      TRUNNION_EXPECTS(decimals == 0);
      return put_unsigned(p, magnitude);
  }
}

}  // namespace

char* put_any_number(char* p, std::int64_t quanta, const NumberStyle& style) {
  auto magnitude = static_cast<std::uint64_t>(quanta);
  if (quanta < 0) {
    *p++ = '-';
    magnitude = 0 - magnitude;
  } else if (style.plus_sign) {
    *p++ = '+';
  }
  p = put_magnitude(p, magnitude, style.decimals);
  if (style.decimals > 0 && !style.trailing_zeros) {
    while (p[-1] == '0') --p;
    if (p[-1] == '.' && !style.point_required) --p;
  } else if (style.decimals == 0 && style.point_required) {
    *p++ = '.';
  }
  return p;
}

}  // namespace trunnion::nc
