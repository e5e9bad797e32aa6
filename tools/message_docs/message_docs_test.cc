#include "message_docs.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "dmslam/wire/codec.h"
#include "dmslam/wire/schema.h"

namespace dmslam {
namespace {

TEST(MessageDocsTest, PageIsNotStale) {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  const std::string path = std::string(source == nullptr ? "." : source) + "/docs/messages.md";
  std::ifstream file(path);
  ASSERT_TRUE(file.good()) << path;
  const std::string page(std::istreambuf_iterator<char>(file), {});
  EXPECT_TRUE(page == MessageDocs()) << "write it anew: bin/dmslam-message-docs --out docs/messages.md";
}

TEST(MessageDocsTest, EveryChannelIsTold) {
  const std::string page = MessageDocs();
  for (const wire::MessageInfo& info : wire::AllInfos()) {
    EXPECT_NE(page.find("| `" + std::string(info.channel) + "`"), std::string::npos) << info.channel;
    const wire::StructType* type = wire::Schema::OfProject().Find(info.type);
    ASSERT_NE(type, nullptr);
    EXPECT_EQ(type->comment.starts_with("Record."), info.is_record) << info.type;
  }
}

TEST(MessageDocsTest, EveryTypeHasASectionAndAPlaceWhereItTravels) {
  const std::string page = MessageDocs();
  for (const auto& [name, type] : wire::Schema::OfProject().types()) {
    EXPECT_NE(page.find("### " + name + "\n"), std::string::npos) << name;
    const bool on_a_channel = page.find("` | [" + name + "](#" + name + ") |") != std::string::npos;
    bool in_another = false;
    for (const auto& [other, outer] : wire::Schema::OfProject().types()) {
      for (const wire::Field& field : outer.fields) in_another |= field.type == name;
    }
    EXPECT_TRUE(on_a_channel || in_another) << name;
  }
}

TEST(MessageDocsTest, DefinitionsFollowTheConventions) {
  for (const auto& [name, type] : wire::Schema::OfProject().types()) {
    EXPECT_FALSE(type.comment.empty()) << name;
    const bool has_utime = type.fields[0].name == "utime" && type.fields[0].type == "int64_t";
    const bool is_part = type.comment.find("art of ") != std::string::npos || name == "record_header_t";
    EXPECT_TRUE(has_utime || is_part) << name;
    bool array_seen = false;
    for (const wire::Field& field : type.fields) {
      const bool is_array = !field.dimensions.empty() && field.dimensions[0].counted_by >= 0;
      array_seen |= is_array;
      EXPECT_FALSE(array_seen && field.name.starts_with("num_"))
          << name << "." << field.name << ": counts come first";
      EXPECT_LE(field.dimensions.size(), 1U) << name << "." << field.name << ": arrays are flat";
    }
  }
}

TEST(MessageDocsTest, ConstantsAreUnique) {
  for (const auto& [name, type] : wire::Schema::OfProject().types()) {
    std::set<std::string> names;
    for (const wire::Constant& constant : type.constants) {
      EXPECT_TRUE(names.insert(constant.name).second) << name << "." << constant.name;
    }
  }
}

}  // namespace
}  // namespace dmslam
