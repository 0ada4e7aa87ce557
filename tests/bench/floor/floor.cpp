// The least that a five-axis post-processor of this kind can do, written for one machine and nothing else:
// reads GOTO lines, solves the inverse kinematics of postconfigs/machines/trunnion_offset.toml, halves every
// segment whose middle is off its chord by more than the tolerance, prints X Y Z A C. No messages, no modal
// words, no limits, no second solution, no care for the pole. What `trunnion post` needs beside it is what it
// costs.
//   floor FILE OUT [TOLERANCE_MM]
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <unistd.h>
#include <vector>

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegrees = 180 / kPi;
constexpr std::size_t kReadBytes = std::size_t{1} << 17;
constexpr std::size_t kShortestLine = 18;  // GOTO/0,0,0,0,0,1
constexpr std::size_t kMostPoints = kReadBytes / kShortestLine + 2;
constexpr int kMostHalvings = 12;

// Points on the axes A and C, mm.
constexpr double kAy = 0.4, kAz = -65, kCx = 0.1, kCz = -30;

struct Vector {
  double x, y, z;
};

// Tip of the tool in the machine for a point of the part, and back. Positive A turns the table about -X,
// positive C about -Z.
inline Vector to_machine(const Vector& p, double sin_a, double cos_a, double sin_c, double cos_c) {
  const double u = p.x - kCx, v = p.y;
  const double y = cos_c * v - sin_c * u - kAy, z = p.z - kAz;
  return {cos_c * u + sin_c * v + kCx, cos_a * y + sin_a * z + kAy, cos_a * z - sin_a * y + kAz};
}
inline Vector to_part(const Vector& m, double sin_a, double cos_a, double sin_c, double cos_c) {
  const double y = m.y - kAy, z = m.z - kAz;
  const double u = m.x - kCx, v = cos_a * y - sin_a * z + kAy;
  return {cos_c * u - sin_c * v + kCx, cos_c * v + sin_c * u, cos_a * z + sin_a * y + kAz};
}

inline Vector half(const Vector& a, const Vector& b) {
  return {0.5 * (a.x + b.x), 0.5 * (a.y + b.y), 0.5 * (a.z + b.z)};
}
inline double distance(const Vector& a, const Vector& b) {
  const double x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return std::sqrt(x * x + y * y + z * z);
}

struct Point {
  Vector tip, axis;  // in the part
  Vector words;      // X Y Z
  double a, c;       // rad
  double sin_a, cos_a, sin_c, cos_c;
};

inline void solve(Point& p, double c_before) {
  const double h2 = p.axis.x * p.axis.x + p.axis.y * p.axis.y;
  const double scale = 1 / std::sqrt(h2 + p.axis.z * p.axis.z);
  const double h = std::sqrt(h2);
  p.sin_a = h * scale;
  p.cos_a = p.axis.z * scale;
  p.a = std::atan2(h, p.axis.z);
  if (h2 < 1e-14) {
    p.c = c_before;
    p.sin_c = std::sin(p.c);
    p.cos_c = std::cos(p.c);
  } else {
    const double g = 1 / h;
    p.sin_c = p.axis.x * g;
    p.cos_c = -p.axis.y * g;
    p.c = std::atan2(p.axis.x, -p.axis.y);
    p.c -= 2 * kPi * std::rint((p.c - c_before) * (0.5 / kPi));
  }
  p.words = to_machine(p.tip, p.sin_a, p.cos_a, p.sin_c, p.cos_c);
}

// Distance of the tip from the middle of its chord half way of all axes; the sines half way are those of the
// bisector.
inline double middle_error(const Point& a, const Point& b) {
  const double sa = a.sin_a + b.sin_a, ca = a.cos_a + b.cos_a, ka = 1 / std::sqrt(sa * sa + ca * ca);
  const double sc = a.sin_c + b.sin_c, cc = a.cos_c + b.cos_c, kc = 1 / std::sqrt(sc * sc + cc * cc + 1e-300);
  return distance(to_part(half(a.words, b.words), sa * ka, ca * ka, sc * kc, cc * kc), half(a.tip, b.tip));
}

// 00 to 99, and 0000 to 9999 with the number of leading zeros.
struct Digits {
  Digits() {
    for (int n = 0; n < 10000; ++n) {
      char* d = four + 4 * n;
      d[0] = static_cast<char>('0' + n / 1000);
      d[1] = static_cast<char>('0' + n / 100 % 10);
      d[2] = static_cast<char>('0' + n / 10 % 10);
      d[3] = static_cast<char>('0' + n % 10);
      zeros[n] = static_cast<unsigned char>(n < 10 ? 3 : n < 100 ? 2 : n < 1000 ? 1 : 0);
    }
  }
  char four[40000];
  unsigned char zeros[10000];
};
const Digits digits;

inline char* put_number(char* p, double value) {
  std::int64_t n = std::llrint(value * 1e4);
  *p = '-';
  p += n < 0;
  if (n < 0) n = -n;
  const auto whole = static_cast<std::uint64_t>(n) / 10000;
  if (whole < 10000) {
    const int zeros = digits.zeros[whole];
    std::memcpy(p, digits.four + 4 * whole + zeros, 4);
    p += 4 - zeros;
  } else {
    p += std::sprintf(p, "%llu", static_cast<unsigned long long>(whole));
  }
  *p++ = '.';
  std::memcpy(p, digits.four + 4 * (static_cast<std::uint64_t>(n) % 10000), 4);
  return p + 4;
}

inline char* put_block(char* p, const Vector& words, double a, double c) {
  *p++ = 'X';
  p = put_number(p, words.x);
  *p++ = ' ';
  *p++ = 'Y';
  p = put_number(p, words.y);
  *p++ = ' ';
  *p++ = 'Z';
  p = put_number(p, words.z);
  *p++ = ' ';
  *p++ = 'A';
  p = put_number(p, a * kDegrees);
  *p++ = ' ';
  *p++ = 'C';
  p = put_number(p, c * kDegrees);
  *p++ = '\n';
  return p;
}

class Output {
 public:
  explicit Output(int file) : file_(file), buffer_(kBytes + kRoom), end_(buffer_.data()) {}
  void block(const Vector& words, double a, double c) {
    end_ = put_block(end_, words, a, c);
    if (end_ > buffer_.data() + kBytes) flush();
  }
  void flush() {
    for (const char* p = buffer_.data(); p < end_;) {
      const ssize_t n = ::write(file_, p, static_cast<std::size_t>(end_ - p));
      if (n <= 0) {
        std::perror("write");
        std::exit(1);
      }
      p += n;
    }
    end_ = buffer_.data();
  }

 private:
  static constexpr std::size_t kBytes = std::size_t{1} << 17, kRoom = 256;
  int file_;
  std::vector<char> buffer_;
  char* end_;
};

// Puts the middle in, then looks at both halves.
std::size_t bisect(const Point& a, const Point& b, double tolerance, int halvings, Output& out) {
  Point m;
  m.tip = half(a.tip, b.tip);
  m.axis = half(a.axis, b.axis);
  solve(m, a.c);
  std::size_t inserted = 1;
  if (halvings > 0 && middle_error(a, m) > tolerance) inserted += bisect(a, m, tolerance, halvings - 1, out);
  out.block(m.words, m.a, m.c);
  if (halvings > 0 && middle_error(m, b) > tolerance) inserted += bisect(m, b, tolerance, halvings - 1, out);
  return inserted;
}

// [-]digits[.digits] with at most 15 digits: the quotient of two exact numbers is rounded correctly.
inline const char* number(const char* p, double& value) {
  static constexpr double kTen[] = {1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  while (*p == ' ' || *p == ',') ++p;
  const bool negative = *p == '-';
  p += negative;
  std::int64_t mantissa = 0;
  unsigned digit = 0;
  for (; (digit = static_cast<unsigned>(*p) - '0') < 10; ++p) mantissa = 10 * mantissa + digit;
  long places = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    for (; (digit = static_cast<unsigned>(*p) - '0') < 10; ++p) mantissa = 10 * mantissa + digit;
    places = p - fraction;
  }
  const double magnitude = static_cast<double>(mantissa) / kTen[places];
  value = negative ? -magnitude : magnitude;
  return p;
}

// Points of the whole lines in [p, end), one array for each quantity; [0] is the last point before them.
struct Chunk {
  double x[kMostPoints], y[kMostPoints], z[kMostPoints], i[kMostPoints], j[kMostPoints], k[kMostPoints];
  double h[kMostPoints], a[kMostPoints], c[kMostPoints];
  double sin_a[kMostPoints], cos_a[kMostPoints], sin_c[kMostPoints], cos_c[kMostPoints];
  double X[kMostPoints], Y[kMostPoints], Z[kMostPoints], error[kMostPoints];
  std::size_t count = 1;

  void read(const char* p, const char* end) {
    count = 1;
    while (p < end) {
      if (std::memcmp(p, "GOTO/", 5) == 0) {
        p = number(number(number(p + 5, x[count]), y[count]), z[count]);
        p = number(number(number(p, i[count]), j[count]), k[count]);
        ++count;
      }
      while (*p++ != '\n') {
      }
    }
  }
  void inverse() {
    for (std::size_t n = 1; n < count; ++n) {
      const double h2 = i[n] * i[n] + j[n] * j[n];
      const double scale = 1 / std::sqrt(h2 + k[n] * k[n]);
      h[n] = std::sqrt(h2);
      const double g = h2 < 1e-14 ? 0 : 1 / h[n];
      sin_a[n] = h[n] * scale;
      cos_a[n] = k[n] * scale;
      sin_c[n] = i[n] * g;
      cos_c[n] = -j[n] * g;
    }
    for (std::size_t n = 1; n < count; ++n) a[n] = std::atan2(h[n], k[n]);
    for (std::size_t n = 1; n < count; ++n) c[n] = std::atan2(i[n], -j[n]);
    for (std::size_t n = 1; n < count; ++n) {
      if (h[n] < 1e-7) {
        c[n] = c[n - 1];
        sin_c[n] = sin_c[n - 1];
        cos_c[n] = cos_c[n - 1];
      }
      c[n] -= 2 * kPi * std::rint((c[n] - c[n - 1]) * (0.5 / kPi));
    }
    for (std::size_t n = 1; n < count; ++n) {
      const Vector words = to_machine({x[n], y[n], z[n]}, sin_a[n], cos_a[n], sin_c[n], cos_c[n]);
      X[n] = words.x;
      Y[n] = words.y;
      Z[n] = words.z;
    }
  }
  Point at(std::size_t n) const {
    return {{x[n], y[n], z[n]}, {i[n], j[n], k[n]}, {X[n], Y[n], Z[n]}, a[n],    c[n],
            sin_a[n],           cos_a[n],           sin_c[n],           cos_c[n]};
  }
  void check() {
    for (std::size_t n = 1; n < count; ++n) error[n] = middle_error(at(n - 1), at(n));
  }
  void keep_last() {
    const std::size_t n = count - 1;
    for (double* v : {x, y, z, i, j, k, h, a, c, sin_a, cos_a, sin_c, cos_c, X, Y, Z}) v[0] = v[n];
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: floor FILE OUT [TOLERANCE_MM]\n", stderr);
    return 2;
  }
  const double tolerance = argc > 3 ? std::atof(argv[3]) : 0.005;
  const int in = ::open(argv[1], O_RDONLY);
  const int file = ::open(argv[2], O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (in < 0 || file < 0) {
    std::perror(in < 0 ? argv[1] : argv[2]);
    return 1;
  }
  Output out(file);
  const auto chunk = std::make_unique<Chunk>();
  std::vector<char> text(kReadBytes + 1);
  std::size_t kept = 0, points = 0, inserted = 0;
  for (;;) {
    const ssize_t got = ::read(in, text.data() + kept, kReadBytes - kept);
    if (got <= 0) break;
    const std::size_t size = kept + static_cast<std::size_t>(got);
    const void* const newline = ::memrchr(text.data(), '\n', size);
    const char* const end = newline != nullptr ? static_cast<const char*>(newline) + 1 : text.data();
    chunk->read(text.data(), end);
    chunk->inverse();
    chunk->check();
    for (std::size_t n = 1; n < chunk->count; ++n) {
      if (points + n > 1 && chunk->error[n] > tolerance)
        inserted += bisect(chunk->at(n - 1), chunk->at(n), tolerance, kMostHalvings, out);
      out.block({chunk->X[n], chunk->Y[n], chunk->Z[n]}, chunk->a[n], chunk->c[n]);
    }
    points += chunk->count - 1;
    chunk->keep_last();
    kept = static_cast<std::size_t>(text.data() + size - end);
    std::memmove(text.data(), end, kept);
  }
  out.flush();
  std::fprintf(stderr, "%zu points, %zu inserted\n", points, inserted);
  return 0;
}
