#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/cross_talk_study.hpp"
#include "trunnion/diagnosis/table_models.hpp"

namespace trunnion::report {

/// {"format", "tables": [{"arguments", "components", "points"}]} of tables that were imported or exported.
std::string tables_json(const std::string& format, const std::vector<ErrorTable>& tables);

/// Held-out figures of all models, the choice, and the gate's verdict where independent lines were given.
std::string table_choice_json(const diagnosis::TableChoice& choice,
                              const std::optional<diagnosis::Gate>& gate);
std::string table_choice_text(const diagnosis::TableChoice& choice,
                              const std::optional<diagnosis::Gate>& gate);

std::string cross_talk_json(const diagnosis::CrossTalkStudy& study);
std::string cross_talk_text(const diagnosis::CrossTalkStudy& study);

}  // namespace trunnion::report
