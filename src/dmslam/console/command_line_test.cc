#include "dmslam/console/command_line.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace dmslam {
namespace {

std::optional<int> Parse(CommandLine& line, std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "program");
  return line.Parse(static_cast<int>(arguments.size()), arguments.data());
}

TEST(CommandLineTest, OptionsAreReadIntoTheirVariables) {
  CommandLine line("what it is for", "program");
  std::string file, text = "as it was";
  uint32_t session = 0;
  double fps = 30;
  bool quiet = false;
  std::optional<int64_t> count;
  std::vector<std::string> sets;
  line.AddOption("file", file, "by its place").Required();
  line.AddOption("--text", text);
  line.AddOption("--session", session);
  line.AddOption("--fps", fps).InRange(0.01, 1000.0);
  line.AddOption("--count", count);
  line.AddOption("--set", sets);
  line.AddFlag("--quiet", quiet);
  EXPECT_EQ(
      Parse(line, {"here", "--session", "7", "--fps", "12.5", "--quiet", "--set", "a=1", "--set", "b=2"}),
      std::nullopt);
  EXPECT_EQ(file, "here");
  EXPECT_EQ(text, "as it was");
  EXPECT_EQ(session, 7u);
  EXPECT_EQ(fps, 12.5);
  EXPECT_EQ(count, std::nullopt);
  EXPECT_TRUE(quiet);
  EXPECT_EQ(sets, (std::vector<std::string>{"a=1", "b=2"}));
}

TEST(CommandLineTest, WhatIsWrongEndsTheProgram) {
  const auto parse = [](std::vector<const char*> arguments) {
    CommandLine line("what it is for", "program");
    std::string file, model;
    int number = 1;
    line.AddOption("--file", file).Required();
    line.AddOption("--number", number).InRange(1, 5);
    line.AddOption("--model", model).OneOf({"e", "f"});
    return Parse(line, std::move(arguments));
  };
  EXPECT_EQ(parse({"--file", "x", "--number", "5", "--model", "e"}), std::nullopt);
  EXPECT_GT(parse({}).value_or(0), 0);
  EXPECT_GT(parse({"--file", "x", "--number", "6"}).value_or(0), 0);
  EXPECT_GT(parse({"--file", "x", "--number", "two"}).value_or(0), 0);
  EXPECT_GT(parse({"--file", "x", "--model", "g"}).value_or(0), 0);
  EXPECT_GT(parse({"--file", "x", "--unheard-of"}).value_or(0), 0);
  EXPECT_EQ(parse({"--help"}), 0);
}

TEST(CommandLineTest, AMainSaysWhatWasThrownAndEndsWithOne) {
  CommandLine line("what it is for", "program");
  const std::vector<const char*> none = {"program"}, wrong = {"program", "--unheard-of"};
  int worked = 0;
  EXPECT_EQ(line.Run(1, none.data(), [&] { ++worked; }), 0);
  EXPECT_GT(line.Run(2, wrong.data(), [&] { ++worked; }), 1);
  EXPECT_EQ(worked, 1);
  testing::internal::CaptureStderr();
  EXPECT_EQ(line.Run(1, none.data(), [] { throw std::runtime_error("a.txt is missing"); }), 1);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "program: a.txt is missing\n");
}

TEST(CommandLineTest, TheSubcommandThatWasNamedIsCalled) {
  CommandLine line("what it is for", "program");
  line.RequireSubcommand();
  int value = 0, called = 0;
  CommandLine& info = line.AddSubcommand("info", "describes");
  info.AddOption("--value", value);
  info.OnParsed([&] { called = value; });
  CommandLine& other = line.AddSubcommand("other", "does nothing");
  EXPECT_EQ(Parse(line, {"info", "--value", "3"}), std::nullopt);
  EXPECT_EQ(called, 3);
  EXPECT_TRUE(info.parsed());
  EXPECT_FALSE(other.parsed());
  EXPECT_GT(Parse(line, {}).value_or(0), 0);
}

}  // namespace
}  // namespace dmslam
