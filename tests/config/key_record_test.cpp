#include "trunnion/config/key_record.hpp"

#include <gtest/gtest.h>

#include "trunnion/config/section.hpp"

namespace trunnion::config {
namespace {

// A reader like those of the files: one key of each type, a table, a list of tables, free names.
void read(const char* toml) {
  const auto value = parse_toml(toml, "t.toml");
  ASSERT_TRUE(value);
  Diagnostics diagnostics;
  Section root(*value, "file", "t.toml", diagnostics);
  static_cast<void>(root.quantity("length_mm"));
  static_cast<void>(root.find_integer("count"));
  root.takes("mode", {"one", "two"});
  static_cast<void>(root.find_text("mode"));
  static_cast<void>(root.flag_or("on", false));
  static_cast<void>(root.find_vector("place_mm"));
  for (Section& s : root.sections("item")) {
    static_cast<void>(s.text("name"));
    if (auto inner = s.find_section("inner")) static_cast<void>(inner->find_numbers("values"));
  }
  if (auto words = root.find_section("words")) {
    static_cast<void>(words->find_text("fixed"));
    for (const std::string& key : words->keys("^[A-Z]+$")) {
      if (key != "fixed") static_cast<void>(words->text(key));
    }
  }
  root.finish();
}

TEST(KeyRecording, WritesDownWhatAReaderAsksFor) {
  FileRecord record;
  {
    const KeyRecording recording(record);
    read("[[item]]\n[item.inner]\n[[item]]\n[words]\nABC = \"x\"\nDE = \"y\"\n");
  }
  read("[unseen]\n");  // nobody records any more

  using Types = std::set<KeyType>;
  EXPECT_EQ(record.size(), 4U);
  const TableRecord& root = record.at("");
  EXPECT_EQ(root.seen, 1U);
  EXPECT_EQ(root.keys.size(), 7U);
  EXPECT_EQ(root.keys.at("length_mm").types, Types{KeyType::number});
  EXPECT_EQ(root.keys.at("length_mm").required, 1U);
  EXPECT_EQ(root.keys.at("count").types, Types{KeyType::integer});
  EXPECT_EQ(root.keys.at("count").required, 0U);
  EXPECT_EQ(root.keys.at("mode").choices, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(root.keys.at("on").types, Types{KeyType::flag});
  EXPECT_EQ(root.keys.at("place_mm").types, Types{KeyType::vector});
  EXPECT_EQ(root.keys.at("item").types, Types{KeyType::tables});
  EXPECT_EQ(root.keys.at("words").types, Types{KeyType::table});

  const TableRecord& item = record.at("item");
  EXPECT_EQ(item.seen, 2U);
  EXPECT_EQ(item.keys.at("name").required, 2U);  // in both
  EXPECT_EQ(record.at("item.inner").seen, 1U);
  EXPECT_EQ(record.at("item.inner").keys.at("values").types, Types{KeyType::numbers});

  const TableRecord& words = record.at("words");
  EXPECT_EQ(words.patterns, (std::set<std::string>{"^[A-Z]+$"}));
  EXPECT_EQ(words.keys.size(), 2U);  // "fixed", and one for all free names
  EXPECT_EQ(words.keys.at("*").types, Types{KeyType::text});
}

TEST(KeyRecording, TakesTheFirstDocumentOnly) {
  FileRecord record;
  const KeyRecording recording(record);
  read("");
  const std::size_t keys = record.at("").keys.size();
  const auto value = parse_toml("other = 1\n", "other.toml");
  Diagnostics diagnostics;
  Section other(*value, "file", "other.toml", diagnostics);
  static_cast<void>(other.find_number("other"));
  EXPECT_EQ(record.at("").keys.size(), keys);
}

}  // namespace
}  // namespace trunnion::config
