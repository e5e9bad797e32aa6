#pragma once

#include <string>

namespace dmslam {

/// What is wrong with a file that is no YAML, as "file.yaml:2: is not valid YAML (column 13: illegal map
/// value)". `error` is a YAML::Exception; a template, so that who includes this need not have yaml-cpp.
template <typename YamlException>
std::string NotYaml(const std::string& path, const YamlException& error) {
  if (error.mark.is_null()) return path + ": is not valid YAML (" + error.msg + ")";
  return path + ":" + std::to_string(error.mark.line + 1) + ": is not valid YAML (column " +
         std::to_string(error.mark.column + 1) + ": " + error.msg + ")";
}

}  // namespace dmslam
