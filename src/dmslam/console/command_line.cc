#include "dmslam/console/command_line.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <exception>
#include <iostream>
#include <utility>

namespace dmslam {

CommandLineOption CommandLineOption::Required() {
  option_->required();
  return *this;
}

CommandLineOption CommandLineOption::ShowDefault() {
  option_->capture_default_str();
  return *this;
}

CommandLineOption CommandLineOption::InRange(int low, int high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

CommandLineOption CommandLineOption::InRange(double low, double high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

CommandLineOption CommandLineOption::Positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

CommandLineOption CommandLineOption::NonNegative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

CommandLineOption CommandLineOption::OneOf(std::initializer_list<std::string> choices) {
  option_->check(CLI::IsMember(std::vector<std::string>(choices)));
  return *this;
}

CommandLineOption CommandLineOption::Delimiter(char delimiter) {
  option_->delimiter(delimiter);
  return *this;
}

CommandLineOption CommandLineOption::Count(int least, int most) {
  option_->expected(least, most);
  return *this;
}

CommandLineOption CommandLineOption::Excludes(CommandLineOption other) {
  option_->excludes(other.option_);
  return *this;
}

CommandLineOption CommandLineOption::Needs(CommandLineOption other) {
  option_->needs(other.option_);
  return *this;
}

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : owned_(std::make_unique<CLI::App>(description, name)), app_(owned_.get()) {
  app_->failure_message([](const CLI::App* app, const CLI::Error& error) {
    return app->get_name() + ": " + error.what() + " (see --help)\n";
  });
}

CommandLine::CommandLine(CLI::App* app) : app_(app) {}

CommandLine::~CommandLine() = default;

void CommandLine::SetVersion(const std::string& version) { app_->set_version_flag("--version", version); }

template <typename Value>
CommandLineOption CommandLine::AddOption(const std::string& names, Value& value, const std::string& help) {
  return CommandLineOption(app_->add_option(names, value, help));
}

template CommandLineOption CommandLine::AddOption(const std::string&, std::string&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, int32_t&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, int64_t&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, uint32_t&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, uint64_t&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, float&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, double&, const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, std::optional<int64_t>&,
                                                  const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, std::vector<std::string>&,
                                                  const std::string&);
template CommandLineOption CommandLine::AddOption(const std::string&, std::vector<int>&, const std::string&);

CommandLineOption CommandLine::AddFlag(const std::string& names, bool& value, const std::string& help) {
  return CommandLineOption(app_->add_flag(names, value, help));
}

CommandLine& CommandLine::AddSubcommand(const std::string& name, const std::string& description) {
  subcommands_.emplace_back(new CommandLine(app_->add_subcommand(name, description)));
  return *subcommands_.back();
}

void CommandLine::RequireSubcommand() { app_->require_subcommand(1); }

void CommandLine::OnParsed(std::function<void()> callback) { app_->callback(std::move(callback)); }

bool CommandLine::parsed() const { return app_->parsed(); }

bool CommandLine::HasSubcommand() const { return !app_->get_subcommands().empty(); }

std::optional<int> CommandLine::Parse(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error);
  }
  return std::nullopt;
}

int CommandLine::Run(int argc, const char* const* argv, const std::function<void()>& work) {
  try {
    if (const std::optional<int> code = Parse(argc, argv)) return *code;
    work();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << app_->get_name() << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace dmslam
