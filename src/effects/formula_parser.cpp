#include "effects/formula_parser.hpp"

#include <algorithm>
#include <cctype>

#include "effects/formula_library.hpp"

namespace trunnion::effects {
namespace {

Error syntax_error(const FormulaHandle& parser, const std::string& text) {
  const FormulaLibrary& library = *parser.get_deleter().library;
  return {ErrorCode::wrong_input,
          "formula \"" + text + "\", character " + std::to_string(library.position(parser.get()) + 1) + ": " +
              library.message(parser.get()),
          {},
          {}};
}

FormulaHandle new_parser(const FormulaLibrary& library) {
  constexpr int kOfDoubles = 0;  // muBASETYPE_FLOAT
  return {library.create(kOfDoubles), {&library}};
}

// Variables of the expression, in the order of their names.
std::vector<std::string> names_of(const FormulaHandle& parser) {
  const FormulaLibrary& library = *parser.get_deleter().library;
  std::vector<std::string> out;
  const int count = library.count_names(parser.get());
  for (int i = 0; i < count; ++i) {
    static std::mutex one_at_a_time;  // the library keeps the name of the last one asked for
    const std::lock_guard lock(one_at_a_time);
    const char* name = nullptr;
    double* value = nullptr;
    library.get_name(parser.get(), static_cast<unsigned>(i), &name, &value);
    out.emplace_back(name);
  }
  return out;
}

bool name_char(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t\n");
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\n") - begin + 1);
}

// Position of the parenthesis that closes the one at `open`; npos when it stays open.
std::size_t closing(const std::string& text, std::size_t open) {
  int depth = 0;
  for (std::size_t i = open; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')' && --depth == 0) return i;
  }
  return std::string::npos;
}

}  // namespace

struct Expression::Instance {
  FormulaHandle parser;
  std::vector<double> values;
};

Expression::~Expression() = default;

std::unique_ptr<Expression::Instance> Expression::make_instance() const {
  auto out = std::make_unique<Instance>();
  out->parser = new_parser(*library_);
  out->values.resize(names_.size());
  for (std::size_t i = 0; i < names_.size(); ++i)
    library_->define_variable(out->parser.get(), names_[i].c_str(), &out->values[i]);
  library_->set_text(out->parser.get(), text_.c_str());
  return out;
}

Result<std::shared_ptr<const Expression>> Expression::compile(const std::string& text,
                                                              const std::vector<std::string>& names) {
  const auto library = FormulaLibrary::load();
  if (!library) return tl::unexpected(library.error());
  const std::shared_ptr<Expression> out(new Expression());
  out->library_ = *library;
  out->text_ = text;
  out->names_ = names;
  auto instance = out->make_instance();
  const auto failed = [&] { return (*library)->failed(instance->parser.get()) != 0; };
  if (!failed()) (*library)->evaluate(instance->parser.get());
  if (failed()) return tl::unexpected(syntax_error(instance->parser, text));
  const std::vector<std::string> used = names_of(instance->parser);
  for (const std::string& name : names)
    out->used_.push_back(std::find(used.begin(), used.end(), name) != used.end());
  out->idle_.push_back(std::move(instance));
  return std::shared_ptr<const Expression>(out);
}

double Expression::operator()(std::span<const double> values) const {
  std::unique_ptr<Instance> instance;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      instance = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!instance) instance = make_instance();
  std::copy(values.begin(), values.end(), instance->values.begin());
  const double result = library_->evaluate(instance->parser.get());
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(instance));
  return result;
}

Result<std::vector<std::string>> names_in(const std::string& text) {
  const auto library = FormulaLibrary::load();
  if (!library) return tl::unexpected(library.error());
  const FormulaHandle parser = new_parser(**library);
  (*library)->set_text(parser.get(), text.c_str());
  std::vector<std::string> out;
  if ((*library)->failed(parser.get()) == 0) out = names_of(parser);
  if ((*library)->failed(parser.get()) != 0) return tl::unexpected(syntax_error(parser, text));
  return out;
}

Result<SplitFormula> take_out_lags(const std::string& formula) {
  SplitFormula out;
  for (std::size_t i = 0; i < formula.size();) {
    const bool at_lag = formula.compare(i, 3, "lag") == 0 && (i == 0 || !name_char(formula[i - 1])) &&
                        formula.find_first_not_of(" \t", i + 3) != std::string::npos &&
                        formula[formula.find_first_not_of(" \t", i + 3)] == '(';
    if (!at_lag) {
      out.text += formula[i++];
      continue;
    }
    const std::size_t open = formula.find('(', i);
    const std::size_t close = closing(formula, open);
    const std::size_t comma = formula.find(',', open);
    const std::string place = "formula \"" + formula + "\", character " + std::to_string(i + 1) + ": ";
    if (close == std::string::npos)
      return fail(ErrorCode::wrong_input, place + "the parenthesis of lag( is not closed");
    if (comma == std::string::npos || comma > close) {
      return fail(ErrorCode::wrong_input, place + "lag needs two arguments, lag(variable, time constant)");
    }
    LagCall call{trimmed(formula.substr(open + 1, comma - open - 1)),
                 trimmed(formula.substr(comma + 1, close - comma - 1))};
    if (call.variable.empty() || !std::all_of(call.variable.begin(), call.variable.end(), name_char)) {
      return fail(ErrorCode::wrong_input,
                  place + "'" + call.variable + "' is not a variable: lag follows a single variable");
    }
    out.text += lag_name(out.lags.size());
    out.lags.push_back(std::move(call));
    i = close + 1;
  }
  return out;
}

}  // namespace trunnion::effects
