#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace dmslam::wire {

/// The version of the protocol in which messages had this fingerprint, where it is a former one: so that what
/// was recorded then is called old and not damaged. None for the types of now, and for what is not ours.
std::optional<int32_t> FormerProtocol(int64_t fingerprint);

/// What is to be told of what a former version has recorded: "recorded by version 0.1; this is ...; use ...".
std::string ToldOfFormer(int32_t protocol);

}  // namespace dmslam::wire
