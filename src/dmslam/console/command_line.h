#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
class Option;
}  // namespace CLI

namespace dmslam {

/// An option of a program, for what is to be said of it besides name, place and help.
class CommandLineOption {
 public:
  explicit CommandLineOption(CLI::Option* option) : option_(option) {}

  CommandLineOption Required();
  /// The help text shows the value that the variable has now.
  CommandLineOption ShowDefault();
  /// Numbers of an integer option lie in [low, high].
  CommandLineOption InRange(int low, int high);
  CommandLineOption InRange(double low, double high);
  CommandLineOption Positive();
  CommandLineOption NonNegative();
  CommandLineOption OneOf(std::initializer_list<std::string> choices);
  /// Several values may be written in one word, with this between them.
  CommandLineOption Delimiter(char delimiter);
  /// How many values there may be.
  CommandLineOption Count(int least, int most);
  CommandLineOption Excludes(CommandLineOption other);
  CommandLineOption Needs(CommandLineOption other);

 private:
  CLI::Option* option_;
};

/// A program's command line: options with help, subcommands, and what is wrong with what was typed. Stands
/// before CLI11, whose headers take ten seconds to compile: they are compiled once, in command_line.cc.
class CommandLine {
 public:
  explicit CommandLine(const std::string& description, const std::string& name = "");
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// --version prints it.
  void SetVersion(const std::string& version);
  /// `names` as "--log,--map", or "file" for what is told by its place. `Value`: std::string, int, int64_t,
  /// uint32_t, uint64_t, float, double, std::optional<int64_t>, or a vector of std::string or int. It must
  /// live as long as this object; without the option it stays as it is.
  template <typename Value>
  CommandLineOption AddOption(const std::string& names, Value& value, const std::string& help = "");
  CommandLineOption AddFlag(const std::string& names, bool& value, const std::string& help = "");

  CommandLine& AddSubcommand(const std::string& name, const std::string& description);
  /// Exactly one of the subcommands must be named.
  void RequireSubcommand();
  /// Called within Parse when this subcommand was named; what it throws is thrown there.
  void OnParsed(std::function<void()> callback);
  /// Whether this subcommand was named; of a program, whether it was parsed.
  bool parsed() const;
  bool HasSubcommand() const;

  /// Reads the arguments. Returns an exit code where the program is to end: after --help and --version, and
  /// where something is wrong, which is printed.
  std::optional<int> Parse(int argc, const char* const* argv);
  /// A whole main: parses, and does the work. What is thrown is said in one line behind the program's name.
  /// Returns the exit code: 0, that of Parse, or 1 where something was thrown.
  int Run(int argc, const char* const* argv, const std::function<void()>& work);

 private:
  explicit CommandLine(CLI::App* app);

  std::unique_ptr<CLI::App> owned_;  ///< of a program; none in a subcommand
  CLI::App* app_;
  std::vector<std::unique_ptr<CommandLine>> subcommands_;
};

}  // namespace dmslam
