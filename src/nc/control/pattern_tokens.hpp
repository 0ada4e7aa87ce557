#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nc/control/patterns.hpp"

// The tokens of a template's line.
namespace trunnion::nc {

std::vector<PatternToken> tokens_of(std::string_view line);
/// Letter, number, letter, number, ...: a set of address words; nothing of anything else, which is a phrase.
std::vector<PatternWord> words_of(const std::vector<PatternToken>& tokens);
/// The same for lines that a reader cannot tell apart.
std::string key_of(std::span<const PatternToken> tokens);
/// An address word among others: G91.
bool holds_word(const std::vector<PatternToken>& tokens, const std::string& word);
bool is_symbols_only(const std::vector<PatternToken>& tokens);
std::vector<Placeholder> placeholders_of(const std::vector<PatternToken>& tokens);
bool has_placeholder(const std::vector<PatternToken>& tokens);
/// "G91" and such: letters with the number behind them.
std::vector<std::string> words_in(const std::vector<PatternToken>& tokens);

}  // namespace trunnion::nc
