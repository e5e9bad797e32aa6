#pragma once

#include <string>

namespace dmslam {

/// The page docs/messages.md: every channel with its owner, rate and size, and every type with its fields,
/// units and constants, from the message definitions and a small table. Throws InvariantError when a type is
/// neither in the table nor part of another one, so that the table cannot go stale.
std::string MessageDocs();

}  // namespace dmslam
