#include "effects/formula_parser.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string_view>

#include "trunnion/base/failure.hpp"

#include "effects/formula_library.hpp"

namespace trunnion::effects {
namespace {

Error syntax_error(const FormulaHandle& parser, const std::string& text) {
  const FormulaLibrary& library = *parser.get_deleter().library;
  // What muParser says of an exception that is none of its own: a lack of memory.
  constexpr std::string_view kNotTheText = "Internal error";
  return {library.message(parser.get()) == kNotTheText ? ErrorCode::io_failed : ErrorCode::wrong_input,
          "formula \"" + text + "\", character " + std::to_string(library.position(parser.get()) + 1) + ": " +
              library.message(parser.get()),
          {},
          {}};
}

FormulaHandle new_parser(const FormulaLibrary& library) {
  constexpr int kOfDoubles = 0;  // muBASETYPE_FLOAT
  return {library.create(kOfDoubles), {&library}};
}

bool name_char(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

bool digit_char(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

// The end of the number that begins at `i`: 12.5e-3.
std::size_t end_of_number(const std::string& text, std::size_t i) {
  while (i < text.size() && (digit_char(text[i]) || text[i] == '.')) ++i;
  if (i == text.size() || (text[i] != 'e' && text[i] != 'E')) return i;
  std::size_t exponent = i + 1;
  if (exponent < text.size() && (text[exponent] == '+' || text[exponent] == '-')) ++exponent;
  if (exponent == text.size() || !digit_char(text[exponent])) return i;
  while (exponent < text.size() && digit_char(text[exponent])) ++exponent;
  return exponent;
}

Error error_at(const std::string& text, std::size_t at, const std::string& what) {
  return {ErrorCode::wrong_input,
          "formula \"" + text + "\", character " + std::to_string(at + 1) + ": " + what,
          {},
          {}};
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
  if (!library) throw Failure(library.error());
  const std::shared_ptr<Expression> out(new Expression());
  out->library_ = *library;
  out->text_ = text;
  out->names_ = names;
  auto instance = out->make_instance();
  const auto failed = [&] { return (*library)->failed(instance->parser.get()) != 0; };
  if (!failed()) (*library)->evaluate(instance->parser.get());
  if (failed()) {
    const Error error = syntax_error(instance->parser, text);
    if (error.code == ErrorCode::io_failed) throw Failure(error);
    return tl::unexpected(error);
  }
  const std::vector<std::string> used = names_in(text);
  for (const std::string& name : names)
    out->used_.push_back(std::binary_search(used.begin(), used.end(), name));
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

std::vector<std::string> names_in(const std::string& text) {
  std::set<std::string> out;
  for (std::size_t i = 0; i < text.size();) {
    if (digit_char(text[i]) || text[i] == '.') {
      i = std::max(end_of_number(text, i), i + 1);
    } else if (name_char(text[i])) {
      const std::size_t begin = i;
      while (i < text.size() && name_char(text[i])) ++i;
      std::string name = text.substr(begin, i - begin);
      const std::size_t next = text.find_first_not_of(" \t\n\r", i);
      const bool function = next != std::string::npos && text[next] == '(';
      if (!function && name != "_pi" && name != "_e") out.insert(std::move(name));
    } else {
      ++i;
    }
  }
  return {out.begin(), out.end()};
}

Result<void> check_signs(const std::string& formula) {
  std::vector<bool> of_function;  // of each open parenthesis
  for (std::size_t i = 0; i < formula.size(); ++i) {
    const char c = formula[i];
    const bool with_equals = std::string_view("=<>!").find(c) != std::string_view::npos;
    if (with_equals && i + 1 < formula.size() && formula[i + 1] == '=') {
      ++i;
    } else if (c == '=') {
      return tl::unexpected(error_at(formula, i, "'=' assigns; a formula compares with '=='"));
    } else if (c == '(') {
      const std::size_t before = i == 0 ? std::string::npos : formula.find_last_not_of(" \t\n\r", i - 1);
      of_function.push_back(before != std::string::npos && name_char(formula[before]));
    } else if (c == ')' && !of_function.empty()) {
      of_function.pop_back();
    } else if (c == ',' && (of_function.empty() || !of_function.back())) {
      return tl::unexpected(
          error_at(formula, i, "',' only divides what a function takes; decimals have a point"));
    } else if (c != '\t' && c != '\n' && c != '\r' && (c < ' ' || c > '~')) {
      return tl::unexpected(error_at(formula, i, "this character has no meaning in a formula"));
    }
  }
  return {};
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
    if (close == std::string::npos)
      return tl::unexpected(error_at(formula, i, "the parenthesis of lag( is not closed"));
    if (comma == std::string::npos || comma > close) {
      return tl::unexpected(error_at(formula, i, "lag needs two arguments, lag(variable, time constant)"));
    }
    LagCall call{trimmed(formula.substr(open + 1, comma - open - 1)),
                 trimmed(formula.substr(comma + 1, close - comma - 1))};
    if (call.variable.empty() || !std::all_of(call.variable.begin(), call.variable.end(), name_char)) {
      return tl::unexpected(
          error_at(formula, i, "'" + call.variable + "' is not a variable: lag follows a single variable"));
    }
    out.text += lag_name(out.lags.size());
    out.lags.push_back(std::move(call));
    i = close + 1;
  }
  return out;
}

}  // namespace trunnion::effects
