#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/report/diagnosis_json.hpp"

namespace trunnion::report {
namespace {

using testing::HasSubstr;
using testing::Not;

// Effects or a mistake in the files: whoever reads only the first lines must see both.
TEST(DiagnosisText, AMistakeInTheFilesStandsBesideEffects) {
  diagnosis::Diagnosis d;
  d.verdict = diagnosis::Verdict::ambiguous;
  d.effects = {"component:EXX"};
  d.sets = {d.effects};
  EXPECT_THAT(diagnosis_text(d), Not(HasSubstr("\nor ")));
  diagnosis::Bookkeeping mistake;
  mistake.words = "the direction of A is the other way round";
  d.bookkeeping = {mistake};
  EXPECT_THAT(diagnosis_text(d),
              HasSubstr("\nor          the files: the direction of A is the other way round\n"));
}

}  // namespace
}  // namespace trunnion::report
