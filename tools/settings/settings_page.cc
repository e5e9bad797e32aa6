#include "settings_page.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "dmslam/settings/settings.h"

namespace dmslam {
namespace {

constexpr const char* kHead =
    "# Configuration\n"
    "\n"
    "Written by `dmslam-settings --out docs/configuration.md`; change `src/dmslam/settings/settings.cc` "
    "instead of "
    "this page.\n"
    "\n"
    "A setting comes from a YAML file (`--config FILE`: sections of keys, as `tracking:` with "
    "`motion_belief: off`\n"
    "below it) or from the command line (`--set tracking.motion_belief=off`, which goes before the file). "
    "The same\n"
    "settings go to every process; a process whose settings differ from the session's is told so by name.\n"
    "`profile=baseline` is the same system with a plain RANSAC two-view start, without mutual exclusion of "
    "new\n"
    "landmarks, without motion belief, with `mapping.min_depth=0`, and without `tracking.smooth_at_end` and\n"
    "`keyframe.at_end`.\n";

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

}  // namespace

std::string SettingsPage() {
  std::vector<std::pair<std::string, std::string>> sections;  // name and rows, in the order of first mention
  for (const SettingInfo& info : ListSettings(Settings{})) {
    const std::string name = SectionOf(info.key);
    auto section = std::ranges::find(sections, name, &std::pair<std::string, std::string>::first);
    if (section == sections.end()) section = sections.insert(section, {name, ""});
    section->second += "| `" + info.key + "` | " + Escaped(info.value) + " | " + Escaped(info.help) + " |\n";
  }
  std::string page = kHead;
  for (const auto& [name, rows] : sections)
    page += "\n## " + name + "\n\n| setting | default | what it does |\n|---|---|---|\n" + rows;
  return page;
}

}  // namespace dmslam
