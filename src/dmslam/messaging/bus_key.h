#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// What a tag says besides that its sender has the key.
struct Tag {
  uint32_t session = 0;  ///< 0: its sender had not learned the session yet
  uint64_t counter = 0;  ///< of the sender's messages, from 1, on whatever channel
  uint64_t sender = 0;   ///< drawn at random when the sender started
};

/// Bytes that a tag adds to a message, at its end: session (4), counter (8), sender (8), keyed MAC (16), mark
/// (8).
inline constexpr size_t kTagBytes = 44;

/// Whether a message ends as one with a tag does. Without a key that is all that can be said.
bool HasTag(std::span<const uint8_t> message);
/// The message itself; all of it where it has no tag.
std::span<const uint8_t> WithoutTag(std::span<const uint8_t> message);

/// The secret that all processes of a system share. The MAC is SipHash-2-4 with 16 bytes of output (Aumasson
/// and Bernstein, 2012), over the message and what its tag says, with a key for each channel.
class BusKey {
 public:
  static constexpr size_t kLeastBytes = 32;
  static constexpr size_t kMostBytes = 4096;
  static constexpr size_t kMacBytes = 16;

  /// Reads a file that nobody but its owner, who must be the user of this process, may read (mode 0600 or
  /// 0400), or that systemd handed over as a credential. A line's end at its end does not count. Throws
  /// InputError that names the file and the cure.
  static BusKey Load(const std::string& path);
  /// The key in `file`, or else in the one that the environment variable DMSLAM_KEY_FILE names; none where
  /// neither is given.
  static std::optional<BusKey> LoadIfWanted(const std::string& file);
  /// `secret`: kLeastBytes to kMostBytes.
  explicit BusKey(std::span<const uint8_t> secret);
  ~BusKey();
  BusKey(const BusKey&) = default;
  BusKey& operator=(const BusKey&) = default;

  /// The message with a tag at its end.
  Bytes WithTag(std::string_view channel, std::span<const uint8_t> message, const Tag& tag) const;
  /// What the tag says, where it fits this key, the channel and the message; nothing else.
  std::optional<Tag> Verify(std::string_view channel, std::span<const uint8_t> tagged) const;

 private:
  using Mac = std::array<uint8_t, kMacBytes>;
  Mac Compute(std::string_view channel, std::span<const uint8_t> message_and_said) const;

  std::array<uint8_t, 16> key_{};  ///< from it the channels' keys are made
};

}  // namespace dmslam
