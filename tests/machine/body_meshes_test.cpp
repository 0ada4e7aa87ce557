#include "trunnion/machine/body_meshes.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "support/machines.hpp"

namespace trunnion {
namespace {

using testing::HasSubstr;

// Two triangles of a square of 10 in the plane z = 5.
Triangles square() {
  return {{0, 0, 5}, {10, 0, 5}, {10, 10, 5}, {0, 0, 5}, {10, 10, 5}, {0, 10, 5}};
}

std::string binary(const Triangles& corners) {
  std::string out(80, ' ');
  const auto put = [&](const auto& value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out.append(bytes, sizeof value);
  };
  put(static_cast<std::uint32_t>(corners.size() / 3));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % 3 == 0) put(std::array<float, 3>{0, 0, 1});
    put(corners[i]);
    if (i % 3 == 2) put(std::uint16_t{0});
  }
  return out;
}

const char* const kText =
    "solid square\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 5\n  vertex 1e1 0 5\n  vertex +10 10 5\n "
    "endloop\n"
    "endfacet\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 5\n  vertex 10 10 5\n  vertex 0 10 5\n "
    "endloop\nendfacet\n"
    "endsolid\n";

TEST(Stl, BinaryAndTextHoldTheSame) {
  for (const std::string& bytes : {binary(square()), std::string(kText)}) {
    const auto read = parse_stl(bytes, "a.stl");
    ASSERT_TRUE(read.has_value()) << read.error().text();
    EXPECT_EQ(*read, square());
  }
  // Binary files that begin as texts do are told by their length.
  std::string bytes = binary(square());
  bytes.replace(0, 5, "solid");
  EXPECT_TRUE(parse_stl(bytes, "a.stl").has_value());
}

TEST(Stl, RefusesWhatIsCutShortOrNoNumber) {
  const std::string bytes = binary(square());
  EXPECT_FALSE(parse_stl(bytes.substr(0, bytes.size() - 1), "a.stl").has_value());
  EXPECT_FALSE(parse_stl("", "a.stl").has_value());
  EXPECT_FALSE(parse_stl(binary({}), "a.stl").has_value());
  Triangles wrong = square();
  wrong[4][1] = std::numeric_limits<float>::quiet_NaN();
  const auto nan = parse_stl(binary(wrong), "a.stl");
  ASSERT_FALSE(nan.has_value());
  EXPECT_THAT(nan.error().message, HasSubstr("triangle 2"));
  std::string text = kText;
  text.replace(text.find("1e1"), 3, "1e1x");
  const auto letter = parse_stl(text, "a.stl");
  ASSERT_FALSE(letter.has_value());
  EXPECT_THAT(letter.error().text(), HasSubstr("a.stl:5"));
  text = kText;
  text.erase(text.find("  vertex 0 10 5\n"), 16);
  EXPECT_FALSE(parse_stl(text, "a.stl").has_value());
  EXPECT_FALSE(parse_stl(std::string(kText).substr(0, 60), "a.stl").has_value());
}

TEST(Stl, CoarserTrianglesStayWhereTheyWere) {
  // A plane of 100 x 100 squares.
  Triangles corners;
  for (int x = 0; x < 100; ++x)
    for (int y = 0; y < 100; ++y)
      for (const auto& c : square())
        corners.push_back({c[0] + 10.0F * static_cast<float>(x), c[1] + 10.0F * static_cast<float>(y), c[2]});
  const Triangles few = coarsened(corners, 2000);
  EXPECT_LE(few.size(), 6000U);
  EXPECT_GT(few.size(), 1000U);
  EXPECT_EQ(coarsened(square(), 2000), square());
  for (const auto& c : few) {
    EXPECT_NEAR(c[2], 5.0, 30.0);
    EXPECT_GE(c[0], -30.0);
    EXPECT_LE(c[0], 1030.0);
  }
}

class Bodies : public testing::Test {
 protected:
  Bodies() {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "square.stl", std::ios::binary) << binary(square());
  }
  ~Bodies() override { std::filesystem::remove_all(folder_); }

  Result<std::vector<BodyMesh>> load(const std::string& bodies) {
    std::ifstream shipped(test::shipped_machine("trunnion_offset").file);
    std::ofstream(folder_ / "machine.toml") << shipped.rdbuf() << "\n" << bodies;
    Diagnostics diagnostics;
    const auto machine = load_machine((folder_ / "machine.toml").string(), diagnostics);
    if (!machine) return tl::unexpected(machine.error());
    return load_body_meshes(*machine, diagnostics);
  }

  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / "trunnion_bodies";
};

TEST_F(Bodies, GoWithTheAxisThatTheFileNames) {
  const auto meshes = load(
      "[[body]]\nof = \"C\"\nfile = \"square.stl\"\n[[body]]\nof = \"bed\"\nfile = \"square.stl\"\nunit = "
      "\"inch\"\n"
      "offset_mm = [1, 2, 3]\n[[body]]\nof = \"spindle\"\nfile = \"square.stl\"\n");
  ASSERT_TRUE(meshes.has_value()) << meshes.error().text();
  ASSERT_EQ(meshes->size(), 3U);
  const Machine machine = test::shipped_machine("trunnion_offset");
  EXPECT_TRUE((*meshes)[0].on_part_side);
  EXPECT_EQ((*meshes)[0].axes, machine.part_chain.size());  // C is the innermost
  EXPECT_EQ((*meshes)[1].axes, 0U);
  EXPECT_EQ((*meshes)[1].corners[1], (std::array<float, 3>{255, 2, 130}));  // 10 in + 1, 0 + 2, 5 in + 3
  EXPECT_FALSE((*meshes)[2].on_part_side);
  EXPECT_EQ((*meshes)[2].axes, machine.tool_chain.size());
}

TEST_F(Bodies, AreNoneWithoutAndRefusedWhereWrong) {
  const auto none = load("");
  ASSERT_TRUE(none.has_value());
  EXPECT_TRUE(none->empty());
  EXPECT_FALSE(load("[[body]]\nof = \"Q\"\nfile = \"square.stl\"\n").has_value());
  EXPECT_FALSE(load("[[body]]\nof = \"C\"\nfile = \"nowhere.stl\"\n").has_value());
  EXPECT_FALSE(load("[[body]]\nof = \"C\"\nfile = \"square.stl\"\nunit = \"cubit\"\n").has_value());
  EXPECT_FALSE(load("[[body]]\nof = \"C\"\nfile = \"square.stl\"\nscale = 2\n").has_value());
}

}  // namespace
}  // namespace trunnion
