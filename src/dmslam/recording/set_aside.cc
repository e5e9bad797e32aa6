#include "dmslam/recording/set_aside.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

bool HoldsAny(const std::string& folder, const std::vector<std::string>& names) {
  return std::ranges::any_of(names, [&](const std::string& name) { return fs::exists(folder + "/" + name); });
}

/// The first one that holds none of these files.
std::string FolderFor(const std::string& folder, int64_t session, const std::vector<std::string>& names) {
  const std::string first = folder + "/former-" + std::to_string(session);
  std::string aside = first;
  for (int i = 2; HoldsAny(aside, names); ++i) aside = first + "-" + std::to_string(i);
  return aside;
}

}  // namespace

std::optional<std::string> SetAside(const std::string& folder, int64_t session,
                                    const std::vector<std::string>& names) {
  std::vector<std::string> left = names;
  std::erase_if(left, [&](const std::string& name) { return !fs::exists(folder + "/" + name); });
  if (left.empty()) return std::nullopt;
  const std::string aside = FolderFor(folder, session, left);
  std::error_code error;
  fs::create_directories(aside, error);
  if (error) throw InputError(aside + ": cannot be made (" + error.message() + "); check " + folder);
  for (const std::string& name : left) {
    if (RenameDurably(folder + "/" + name, aside + "/" + name)) continue;
    throw InputError(folder + "/" + name + ": is of another run, and cannot be moved to " + aside + " (" +
                     std::strerror(errno) + "); check their rights");
  }
  SyncFolderOf(folder + "/" + left.front());
  return aside;
}

}  // namespace dmslam
