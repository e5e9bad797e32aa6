#pragma once

#include <string>

namespace dmslam {

/// The page docs/configuration.md: every setting with its default and what it does, in Markdown.
std::string SettingsPage();

}  // namespace dmslam
