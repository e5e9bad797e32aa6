#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "dmslam/record_header_t.hpp"
#include "dmslam/util/version.h"

namespace dmslam {

/// Encoded messages. Records are kept for repair, so they are shared rather than copied.
using Bytes = std::vector<uint8_t>;
using SharedBytes = std::shared_ptr<const Bytes>;

/// The header every record carries at byte 16 (lcmtypes/dmslam_record_header_t.lcm).
using RecordHeader = record_header_t;

/// The ordered streams of a system. Each has one writer at a time.
enum class StreamId : int32_t {
  kPlayer = 1,      ///< frames, camera, end of the sequence
  kFrontend = 2,    ///< session, keyframes, frame poses, evidence
  kMap = 3,         ///< the map, written by the mapper
  kLoopCloser = 4,  ///< checked(k) and corrections
  kHandOver = 5,    ///< a replica on its way to a mapper that starts
  kTest = 100,
};

/// A writer's term of office. The higher one counts; equal epochs are settled by the random writer id.
struct Term {
  int64_t epoch = 0;
  int64_t writer = 0;
  bool valid() const { return epoch > 0; }
  auto operator<=>(const Term&) const = default;
};

/// How far a replica is: all records of `epoch` up to `seq`, and whatever that epoch continued. Zero: holds
/// nothing.
struct Version {
  int64_t epoch = 0;
  int64_t seq = 0;
  bool empty() const { return epoch == 0; }
  auto operator<=>(const Version&) const = default;
};

/// A message to be sent. `local` ones are a tap for spy and logger on this host: they must not leave it (ttl
/// 0).
struct Outgoing {
  std::string channel;
  SharedBytes bytes;
  bool local = false;
};

/// A record as a reader hands it out: intact, once, and in order.
struct Record {
  std::string channel;
  SharedBytes bytes;
  RecordHeader header;

  bool fresh() const { return (header.flags & RecordHeader::FLAG_FRESH) != 0; }
  bool in_snapshot() const { return (header.flags & RecordHeader::FLAG_SNAPSHOT) != 0; }
  bool ends_snapshot() const { return (header.flags & RecordHeader::FLAG_SNAPSHOT_LAST) != 0; }
  /// Whether what the reader's owner holds is void from here on: the first record of a term that continues
  /// nothing, or of a snapshot.
  bool begins_anew() const { return header.seq == 1 && (fresh() || in_snapshot()); }
  /// Who wrote it.
  Term term() const { return {header.epoch, header.writer}; }
  /// What its owner holds once it has applied this; inside a snapshot nothing that is whole.
  Version version() const {
    if (!in_snapshot()) return {header.epoch, header.seq};
    return ends_snapshot() ? Version{header.epoch, header.parent_seq} : Version{};
  }
};

/// Whether records leave the host. On a host they travel whole, as one typed message each; on a LAN in parts
/// that fit one datagram, since a message of many datagrams dies with any of them.
enum class Link { kHost, kLan };

/// Names of the protocol's channels. `owner` is the upper-case name of a process: "MAPPER".
inline std::string HeadChannel(const std::string& owner) { return "DMSLAM_" + owner + "_HEAD"; }
inline std::string PartChannel(const std::string& owner) { return "DMSLAM_" + owner + "_PART"; }
inline std::string AckChannel(const std::string& reader) { return "DMSLAM_" + reader + "_ACK"; }
inline std::string TakeOverChannel(const std::string& owner) { return "DMSLAM_" + owner + "_TAKE_OVER"; }
inline std::string HandOverChannel(const std::string& owner) { return "DMSLAM_" + owner + "_HAND_OVER"; }
inline std::string ReplicaChannel(const std::string& holder) { return "DMSLAM_" + holder + "_REPLICA"; }

}  // namespace dmslam
