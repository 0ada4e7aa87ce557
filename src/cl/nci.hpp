#pragma once
#include <cstdint>

#include "cl/context.hpp"
#include "cl/scanner.hpp"

namespace trunnion::cl {

/// Reads the records of a Mastercam NCI file.
class NciReader {
 public:
  /// One record into `context`; false at the end.
  bool next(Context& context, Scanner& scanner);

 private:
  void read(Context& context, std::uint64_t code, const Statement& statement);
  static void read_tool(Context& context, std::uint64_t code, const Statement& statement);
  static bool take_feed(Context& context, const Statement& statement, std::size_t at);
  bool allowed(Context& context, const Statement& statement, std::size_t compensation_at,
               bool in_plane) const;
  void read_motion(Context& context, std::uint64_t code, const Statement& statement);
  void read_five_axis(Context& context, const Statement& statement) const;
  void read_arc(Context& context, bool clockwise, const Statement& statement) const;

  bool plane_turned_ = false;
  bool system_turned_ = false;
};

}  // namespace trunnion::cl
