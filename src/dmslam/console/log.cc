#include "dmslam/console/log.h"

#include <fmt/args.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace dmslam {
namespace {

spdlog::level::level_enum LevelOf(LogLevel level) {
  switch (level) {
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
    case LogLevel::kCritical:
      break;
  }
  return spdlog::level::critical;
}

}  // namespace

std::string FormatLine(std::string_view format, std::initializer_list<LogValue> values) {
  fmt::dynamic_format_arg_store<fmt::format_context> arguments;
  for (const LogValue& value : values) {
    std::visit([&](const auto& held) { arguments.push_back(held); }, value.held());
  }
  return fmt::vformat(format, arguments);
}

void LogLine(LogLevel level, std::string_view format, std::initializer_list<LogValue> values) {
  if (!spdlog::should_log(LevelOf(level))) return;
  spdlog::default_logger_raw()->log(LevelOf(level), spdlog::string_view_t(FormatLine(format, values)));
}

void SetUpLog(const std::string& program, bool quiet) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(program));
  spdlog::set_pattern("%H:%M:%S.%e %n %l: %^%v%$");
  spdlog::set_level(quiet ? spdlog::level::warn : spdlog::level::info);
}

}  // namespace dmslam
