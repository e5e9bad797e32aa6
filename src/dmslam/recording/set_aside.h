#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dmslam {

/// Moves the files of `names` that are in `folder`, and that a run of `session` has left, into a folder of
/// their own: FOLDER/former-SESSION, or FOLDER/former-SESSION-2 and so on where a file of such a name is kept
/// there already. Nothing is overwritten; where it is cut short, the next call moves the rest to the others.
/// The file by which a run is known comes last among `names`. Returns the folder; none where no file is
/// there. Throws InputError that names the file and the reason.
std::optional<std::string> SetAside(const std::string& folder, int64_t session,
                                    const std::vector<std::string>& names);

}  // namespace dmslam
