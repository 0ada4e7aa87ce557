#include "trunnion/cl/reader.hpp"

#include <algorithm>
#include <cctype>

#include "cl/context.hpp"
#include "cl/nci.hpp"
#include "cl/scanner.hpp"
#include "cl/source.hpp"
#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

bool names_nci(std::string_view file) {
  constexpr std::string_view kEnding = ".nci";
  if (file.size() < kEnding.size()) return false;
  return std::equal(kEnding.begin(), kEnding.end(), file.end() - static_cast<std::ptrdiff_t>(kEnding.size()),
                    [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
}

}  // namespace

class Reader::Impl {
 public:
  Impl(std::unique_ptr<TextSource> source, const std::string& file, const ReaderOptions& options,
       Diagnostics& diagnostics)
      : context(file, options, diagnostics),
        scanner_(std::move(source), context.findings()),
        is_nci_(options.dialect == ReaderOptions::Dialect::nci ||
                (options.dialect == ReaderOptions::Dialect::automatic && names_nci(file))) {}

  bool next(Record& record) {
    for (;;) {
      if (has_pending_ && context.take(record)) return true;
      has_pending_ = false;
      if (ended_) return false;
      PlainGoto plain;
      if (!is_nci_ && scanner_.plain_goto(plain)) {
        if (context.plain_motion(plain, record)) return true;
        scanner_.unread_goto();
      }
      read_slowly();
    }
  }
  std::size_t next_cuts(std::span<PlainCut> cuts, Feed& feed) {
    if (is_nci_ || ended_ || !context.takes_cuts()) return 0;
    const std::size_t count = scanner_.plain_run(cuts);
    const std::size_t good = context.plain_cuts(cuts.first(count));
    if (good < count) scanner_.unread_run(count - good);
    feed = context.modal.feed;
    return good;
  }
  const std::optional<Error>& read_failure() const { return scanner_.read_failure(); }

  Context context;

 private:
  void read_slowly() {
    if (!(is_nci_ ? nci_.next(context, scanner_) : read_statement_of_text())) {
      ended_ = true;
      if (context.modal.nurbs) finish_nurbs(context);
      context.finish(scanner_.line_count(), scanner_.last_number());
    }
    if (!context.reads_on()) scanner_.stop();
    has_pending_ = true;
  }

  bool read_statement_of_text() {
    if (!scanner_.next(statement_)) return false;
    if (statement_.kind == Statement::Kind::comment) {
      read_comment(context, statement_);
    } else if (statement_.kind == Statement::Kind::directive) {
      read_directive(context, statement_);
    } else {
      read_statement(context, statement_);
    }
    return true;
  }

  Scanner scanner_;
  NciReader nci_;
  bool is_nci_;
  Statement statement_;
  bool has_pending_ = false;
  bool ended_ = false;
};

Reader::Reader(std::string_view text, const std::string& file, const ReaderOptions& options,
               Diagnostics& diagnostics)
    : Reader(std::make_unique<MemorySource>(text), file, options, diagnostics) {}

Reader::Reader(std::unique_ptr<TextSource> source, const std::string& file, const ReaderOptions& options,
               Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(std::move(source), file, options, diagnostics)) {}

Reader::Reader(Reader&&) noexcept = default;
Reader::~Reader() = default;

bool Reader::next(Record& record) {
  return impl_->next(record);
}
std::size_t Reader::next_cuts(std::span<PlainCut> cuts, Feed& feed) {
  return impl_->next_cuts(cuts, feed);
}
const std::optional<Error>& Reader::read_failure() const {
  return impl_->read_failure();
}
const Resolution& Reader::resolution() const {
  return impl_->context.resolution();
}

namespace {

Result<Program> collect(std::unique_ptr<TextSource> source, const std::string& file,
                        const ReaderOptions& options, Diagnostics& diagnostics) {
  Diagnostics own;  // errors that were there before are not ours
  Reader reader(std::move(source), file, options, own);
  Program program;
  program.file = file;
  Record record;
  while (reader.next(record)) program.records.push_back(std::move(record));
  program.resolution = reader.resolution();
  diagnostics.append(own);
  if (reader.read_failure()) return tl::unexpected<Error>(*reader.read_failure());
  if (own.has_errors()) return tl::unexpected<Error>(own.first_error());
  return program;
}

}  // namespace

Result<Program> read_program(std::string_view text, const std::string& file, const ReaderOptions& options,
                             Diagnostics& diagnostics) {
  return collect(std::make_unique<MemorySource>(text), file, options, diagnostics);
}

Result<Program> load_program(const std::string& path, const ReaderOptions& options,
                             Diagnostics& diagnostics) {
  auto source = open_source(path);
  if (!source) return tl::unexpected<Error>(source.error());
  return collect(std::move(*source), path, options, diagnostics);
}

}  // namespace trunnion::cl
