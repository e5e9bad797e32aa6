#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/types.h"
#include "dmslam/util/random.h"
#include "dmslam/wire/codec.h"

namespace dmslam::simulation {

/// What a forged message says of what is played and computed.
enum class Content : uint8_t {
  kSession,       ///< a stream of now, or of a later term, begins with settings that nobody has
  kCamera,        ///< another camera is played
  kFurther,       ///< the frontend is further than its player
  kSequenceDone,  ///< the frontend has answered the end
  kEnd,           ///< the sequence has ended
  kFarFrame,      ///< a frame of long after
  kNextFrame,     ///< the frame after the newest one, grey all over
  kDone,          ///< the newest frame is done
  kNextRecord,    ///< the next record of a stream, with an earlier one's content
  kReset,         ///< the next record of the frontend's: the first map is dropped
};
inline constexpr int kNumContents = 10;

std::string ToText(Content content);
/// Whether somebody may lose what the message stands for. The others are believed only when they are
/// repeated, or not contradicted, for a tenth of a second.
bool MayCost(Content content);

/// Forges one message at a time of what it has heard, with every checksum right: one of each kind that
/// tests/system/forger.cc sends to processes.
class ContentForger {
 public:
  void Hear(const Outgoing& message);
  /// None before it has heard what the message is made of.
  std::optional<Outgoing> Make(Content content, Random* random) const;

 private:
  template <typename Message>
  std::optional<Message> Last() const {
    const Bytes* bytes = LastOf(wire::Info<Message>().channel);
    return bytes == nullptr ? std::nullopt : wire::Decode<Message>(*bytes);
  }
  const Bytes* LastOf(const std::string& channel) const;
  std::optional<RecordHeader> NewestHeaderOf(const std::string& channel) const;

  std::optional<Outgoing> Session(bool of_later_term) const;
  std::optional<Outgoing> NextRecord(const std::string& channel) const;
  std::optional<Outgoing> Reset() const;
  std::optional<Outgoing> OtherCamera() const;
  /// What follows from the newest frame.
  std::optional<Outgoing> OfFrame(Content content) const;

  std::map<std::string, SharedBytes> last_;  ///< of each channel
};

}  // namespace dmslam::simulation
