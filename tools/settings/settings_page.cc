#include "settings_page.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "dmslam/settings/registry.h"

namespace dmslam {
namespace {

constexpr const char* kHead = R"(# Configuration

Written by `dmslam-settings --out docs/configuration.md`. A setting is described beside the field that it sets, in the
`Describe` of its options struct (for example `src/dmslam/tracking/tracking_options.h`); change that instead of this page.

A setting comes from a YAML file (`--config FILE`: sections of keys, as `tracking:` with `motion_belief: off` below it) or
from the command line (`--set tracking.motion_belief=off`, which takes precedence over the file). The order within a file does not
matter. `profile` comes before everything else, wherever it stands: `profile=baseline` is the same system with a plain
RANSAC two-view start and with the values of the column "baseline"; `profile=paper` is the system of the DM-SLAM paper alone:
DLRSAC as published, Algorithm 1 with a bound that bites, and the values of the column "paper".

The same settings go to every process. A mapper, loop closer or collector whose settings or vocabulary differ from the
frontend's refuses the session by name and ends with exit code 2. A setting that does not exist, or a value that is not
allowed, is refused with file, line, key and what is allowed.
)";

std::string SectionOf(const std::string& key) {
  const size_t dot = key.find('.');
  return dot == std::string::npos ? "general" : key.substr(0, dot);
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

std::string RowOf(const SettingInfo& info) {
  std::string row = "|";
  for (const std::string& cell : {"`" + info.key + "`", info.value, info.baseline.value_or(""),
                                  info.paper.value_or(""), info.allowed, info.unit, info.help}) {
    if (!cell.empty()) row += ' ';
    row += Escaped(cell);
    row += " |";
  }
  return row + "\n";
}

}  // namespace

std::string SettingsPage() {
  std::vector<std::pair<std::string, std::string>> sections;  // name and rows, in the order of first mention
  for (const SettingInfo& info : AllSettings()) {
    const std::string name = SectionOf(info.key);
    auto section = std::ranges::find(sections, name, &std::pair<std::string, std::string>::first);
    if (section == sections.end()) section = sections.insert(section, {name, ""});
    section->second += RowOf(info);
  }
  std::string page = kHead;
  for (const auto& [name, rows] : sections)
    page += "\n## " + name +
            "\n\n| setting | default | baseline | paper | allowed | unit | what it does "
            "|\n|---|---|---|---|---|---|---|\n" +
            rows;
  return page;
}

}  // namespace dmslam
