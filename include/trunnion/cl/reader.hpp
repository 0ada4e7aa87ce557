#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/cl/record.hpp"

namespace trunnion::cl {

struct ReaderOptions {
  /// `automatic`: Mastercam NCI when the file's name ends in .nci, else APT/CL text.
  enum class Dialect : std::uint8_t { automatic, apt, nci };
  Dialect dialect = Dialect::automatic;
  /// Unit of a file that says none (no UNITS word; every NCI file). Nothing: mm with a note, unless a feed is
  /// in inches: then an error, for such a file may be in either.
  enum class Units : std::uint8_t { mm, inch };
  std::optional<Units> units;
  /// Somebody asked for `units`: a UNITS that says the other one is told, and holds.
  bool units_are_asked_for = false;
  /// NX, MSYS (the program's frame in the absolute system). `automatic`: the points are given in MSYS, as
  /// Siemens documents, unless the first tool axis shows that they are in the absolute system: it points down
  /// there and up in MSYS. `apply`: they are in the absolute system. `ignore`: every point stands as it is,
  /// whatever MSYS follows.
  enum class Frames : std::uint8_t { automatic, apply, ignore };
  Frames frames = Frames::automatic;
  /// CUTCOM/LEFT and RIGHT. `refuse`: an error, unless the file says that its points are those of the tool's
  /// center. `tool_center`: they are, and CUTCOM is left out with a warning. `wear`: they are, and the
  /// control adds the wear of a register: CutterCompensation records.
  enum class CutterCompensation : std::uint8_t { refuse, tool_center, wear };
  CutterCompensation cutter_compensation = CutterCompensation::refuse;
  /// Every arc becomes straight motions that stay so near to it.
  double arc_tolerance_mm = 0.001;
  /// A ShapeBegin before the motions that stand for an arc or a hole.
  bool mark_shapes = false;
};

/// Where the text comes from, piece by piece.
class TextSource {
 public:
  virtual ~TextSource() = default;
  /// Fills at most `capacity` bytes; 0 at the end.
  virtual Result<std::size_t> read(char* buffer, std::size_t capacity) = 0;
};

/// A file read in large pieces; `-` is standard input. Fails with io_failed.
Result<std::unique_ptr<TextSource>> open_source(const std::string& path);

/// How finely the file is written: half of the last decimal place seen so far.
struct Resolution {
  double coordinate_mm = 0.0;
  /// Of the tool axis components (no unit): InverseOptions::axis_resolution. 0 when no axis with three
  /// decimals or more was seen: `0,0,1` is exact.
  double axis = 0.0;
};

/// Where the records of a path come from, one after the other, whatever text they are read from.
class RecordSource {
 public:
  virtual ~RecordSource() = default;

  /// The next record; false at the end of the text. Reading a motion into a record that held a motion
  /// allocates nothing.
  virtual bool next(Record& record) = 0;

  /// The next motions at once, as many as there are in a row of the plain kind: no rapids, their lines laid
  /// out as those before them. They have one feed. 0: `next` gives what follows. Either may be called at any
  /// time.
  virtual std::size_t next_cuts(std::span<PlainCut> cuts, Feed& feed) = 0;

  /// The failure of the source that ended the text early, if one did (it is among the diagnostics, too).
  virtual const std::optional<Error>& read_failure() const = 0;
  virtual const Resolution& resolution() const = 0;
};

/// Reads APT/CL text as a stream of records, in memory that does not grow with the text.
///
/// Everything that is wrong goes to `diagnostics` with line and column, and reading goes on: a record with a
/// fault is left out. Use nothing of what was read when `diagnostics.has_errors()` in the end. Words that
/// change geometry and are not understood are errors, display words are skipped, any other unknown word is
/// one warning.
class Reader final : public RecordSource {
 public:
  /// `text` and `diagnostics` must outlive the reader.
  Reader(std::string_view text, const std::string& file, const ReaderOptions& options,
         Diagnostics& diagnostics);
  Reader(std::unique_ptr<TextSource> source, const std::string& file, const ReaderOptions& options,
         Diagnostics& diagnostics);
  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) = delete;
  ~Reader() override;

  bool next(Record& record) override;
  std::size_t next_cuts(std::span<PlainCut> cuts, Feed& feed) override;
  const std::optional<Error>& read_failure() const override;
  const Resolution& resolution() const override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// A whole file.
struct Program {
  std::string file;
  std::vector<Record> records;
  Resolution resolution;
};

/// All records of `text`. Fails with the first error (all of them are in `diagnostics`); a text without any
/// motion is an error.
Result<Program> read_program(std::string_view text, const std::string& file, const ReaderOptions& options,
                             Diagnostics& diagnostics);
/// As above, from a file (`-` is standard input).
Result<Program> load_program(const std::string& path, const ReaderOptions& options, Diagnostics& diagnostics);

}  // namespace trunnion::cl
