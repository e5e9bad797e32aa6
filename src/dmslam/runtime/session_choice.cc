#include "dmslam/runtime/session_choice.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/roles.h"

namespace dmslam {
namespace {

constexpr const char* kWriters[] = {owners::kPlayer, owners::kFrontend, owners::kMapper, owners::kLoopCloser};
constexpr int kUnnamed = static_cast<int>(std::size(kWriters));
constexpr size_t kMostSessions = 16;  // more are noise

int RankOf(std::string_view channel) {
  const auto* writer =
      std::find_if(std::begin(kWriters), std::end(kWriters),
                   [channel](const std::string& owner) { return channel.starts_with("DMSLAM_" + owner); });
  return static_cast<int>(writer - std::begin(kWriters));
}

/// "player on host pid 17" of "player on host (pid 17)", which stands in brackets itself.
std::string WithoutBrackets(std::string name) {
  std::erase_if(name, [](char c) { return c == '(' || c == ')'; });
  return name;
}

}  // namespace

std::vector<std::string> SessionChoice::Channels(uint32_t num_cameras) {
  std::vector<std::string> channels;
  for (uint32_t camera = 0; camera < num_cameras; ++camera) {
    for (const char* owner : {owners::kPlayer, owners::kFrontend})
      channels.push_back(HeadChannel(OfCamera(owner, static_cast<CameraId>(camera))));
  }
  channels.insert(channels.end(), {HeadChannel(owners::kMapper), HeadChannel(owners::kLoopCloser)});
  return channels;
}

void SessionChoice::HearBeacon(std::string_view channel, std::span<const uint8_t> bytes) {
  if (FingerprintOf(bytes) != head_t::getHash()) return;
  const auto head = DecodeHead(channel, bytes);
  if (!head || head->state == head_t::STATE_CLOSED) return;
  if (said_.SaidAgain({head->header.session, head->header.writer}, head->utime))
    Know(head->header.session, RankOf(channel), head->name);
}

void SessionChoice::HearCamera(uint32_t session, const std::string& sequence, int64_t utime) {
  if (said_.SaidAgain({session, 0}, utime)) Know(session, kUnnamed, "player of " + sequence);
}

void SessionChoice::Know(int64_t session, int rank, const std::string& name) {
  const auto known = ranks_.find(session);
  if (known == ranks_.end() ? ranks_.size() >= kMostSessions : known->second <= rank) return;
  ranks_[session] = rank;
  names_[session] = name;
}

std::string SessionChoice::Problem() const {
  if (names_.size() < 2) return "";
  std::string list;
  for (const auto& [session, name] : names_)
    list += (list.empty() ? "" : "; ") + std::to_string(session) + ": " + WithoutBrackets(name);
  const std::string count = names_.size() == 2 ? "two" : std::to_string(names_.size());
  return count + " sessions are on this bus (" + list + "): choose one with --session";
}

}  // namespace dmslam
