#include "dmslam/wire/former_types.h"

#include <algorithm>
#include <array>

#include "dmslam/util/version.h"
#include "dmslam/wire/codec_impl.h"

namespace dmslam::wire {
namespace {

struct FormerType {
  uint64_t fingerprint = 0;
  const char* name = nullptr;
};

/// As protocol 1 had them. Add a table of the present ones (the first eight bytes of tests/golden) when the
/// protocol changes again.
constexpr std::array kProtocol1 = {
    FormerType{0xb0cb92b2854c490fULL, "camera_info_t"},
    FormerType{0xb218f81c1f01adedULL, "checked_t"},
    FormerType{0xdc86e6810d7e48c6ULL, "end_of_sequence_t"},
    FormerType{0x0951874b678cb7cbULL, "features_t"},
    FormerType{0x8881506d1c5900a5ULL, "frame_done_t"},
    FormerType{0xe1b3047d8a4f7068ULL, "frame_evidence_t"},
    FormerType{0x29e52ea1e153157aULL, "frame_pose_t"},
    FormerType{0x8b4e6839ab2ee5beULL, "frame_t"},
    FormerType{0x25aca93d6f8f91e3ULL, "frame_trace_t"},
    FormerType{0x42518071cfd58487ULL, "frontend_status_t"},
    FormerType{0x2938536032aeade2ULL, "ground_truth_pose_t"},
    FormerType{0x06ca74164424ef81ULL, "initial_map_t"},
    FormerType{0x260b46b8acc9e57eULL, "keyframe_t"},
    FormerType{0xdd08269cbe3f07f9ULL, "loopcloser_status_t"},
    FormerType{0x60594f88dd67af37ULL, "map_record_t"},
    FormerType{0x2c7d3bd897d84032ULL, "map_reset_t"},
    FormerType{0x40d84b1129d14a42ULL, "mapper_status_t"},
    FormerType{0xf5d9ab6740c32faaULL, "player_status_t"},
    FormerType{0x6d8b9c927a471726ULL, "pose_t"},
    FormerType{0x7a4bdb70cf57397fULL, "session_t"},
};

}  // namespace

std::optional<int32_t> FormerProtocol(int64_t fingerprint) {
  const bool first = std::any_of(kProtocol1.begin(), kProtocol1.end(), [fingerprint](const FormerType& type) {
    return type.fingerprint == static_cast<uint64_t>(fingerprint);
  });
  return first ? std::optional<int32_t>(1) : std::nullopt;
}

std::string ToldOfFormer(int32_t protocol) {
  return "recorded by " + NameOfProtocol(protocol) + "; this is version " + kVersion +
         ", which cannot read it; use " + NameOfProtocol(protocol) + ", or record it again";
}

std::string OtherTypeFault(int64_t fingerprint) {
  const std::optional<int32_t> former = FormerProtocol(fingerprint);
  if (!former) return "another type, or another version of it";
  return "as " + NameOfProtocol(*former) + " sends it; this is version " + kVersion;
}

}  // namespace dmslam::wire
