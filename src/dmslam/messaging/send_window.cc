#include "dmslam/messaging/send_window.h"

#include <algorithm>

#include "dmslam/messaging/packing.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/part_t.hpp"

namespace dmslam {

void SendWindow::Append(std::string channel, SharedBytes record) {
  kept_.push_back({std::move(channel), std::move(record), INT64_MIN / 2, {}, {}});
  bytes_ += kept_.back().plain_bytes();
}

void SendWindow::DiscardThrough(int64_t seq) {
  for (; !kept_.empty() && first_ <= seq; ++first_) {
    bytes_ -= kept_.front().plain_bytes();
    kept_.pop_front();
  }
  if (next_seq_ < first_) {
    next_seq_ = first_;
    next_part_ = 0;
  }
  repairs_.erase(repairs_.begin(), repairs_.lower_bound({first_, 0}));
}

/// On a host always, on a LAN where it fits one datagram.
bool SendWindow::TravelsWhole(const Kept& kept) const {
  return options_.link == Link::kHost || kept.plain_bytes() <= static_cast<size_t>(options_.part_bytes);
}

void SendWindow::Cut(Kept& kept) const {
  if (kept.content.empty()) kept.content = ContentOf(kept.channel, *kept.record, options_.pack);
}

int64_t SendWindow::NumParts(const Kept& kept) const {
  return (static_cast<int64_t>(kept.content.size()) + options_.part_bytes - 1) / options_.part_bytes;
}

void SendWindow::Repair(const ack_t& ack, int64_t now_ns) {
  for (size_t i = 0; i < static_cast<size_t>(ack.num_missing); ++i) {
    const int64_t from = std::max(ack.missing_first_seq[i], first_);
    const int64_t to = std::min(ack.missing_last_seq[i], std::min(last(), next_seq_));
    const bool partly = ack.missing_first_seq[i] == ack.missing_last_seq[i] && ack.missing_end_byte[i] > 0;
    for (int64_t seq = from; seq <= to; ++seq) {
      const int64_t begin = partly ? std::max(0, ack.missing_first_byte[i]) : 0;
      RepairRange(seq, begin, partly ? ack.missing_end_byte[i] : INT32_MAX, now_ns);
    }
  }
}

void SendWindow::RepairRange(int64_t seq, int64_t first_byte, int64_t end_byte, int64_t now_ns) {
  Kept& kept = at(seq);
  if (now_ns - kept.sent_ns < options_.resend_after_ns) return;
  Cut(kept);
  const int64_t end = std::min(end_byte, static_cast<int64_t>(kept.content.size()));
  for (int64_t part = first_byte / options_.part_bytes; part * options_.part_bytes < end; ++part) {
    if (seq == next_seq_ && part >= next_part_) return;  // will be sent anyway
    const auto index = static_cast<size_t>(part);
    const bool recent =
        !kept.part_sent_ns.empty() && now_ns - kept.part_sent_ns[index] < options_.resend_after_ns;
    if (!recent) repairs_.insert({seq, part});
  }
}

int SendWindow::Send(int budget, int64_t now_ns, std::vector<Outgoing>* out) {
  while (budget > 0 && !repairs_.empty()) {
    const auto [seq, part] = *repairs_.begin();
    repairs_.erase(repairs_.begin());
    const int64_t before = bytes_sent;
    SendPart(seq, part, now_ns, out);
    ++parts_repaired;
    bytes_repaired += bytes_sent - before;
    --budget;
  }
  return SendNew(budget, now_ns, out);
}

int SendWindow::SendNew(int budget, int64_t now_ns, std::vector<Outgoing>* out) {
  while (budget > 0 && next_seq_ <= last()) {
    Kept& kept = at(next_seq_);
    if (next_part_ == 0 && TravelsWhole(kept)) {
      out->push_back({kept.channel, kept.record, false});
      kept.sent_ns = now_ns;
      bytes_sent += static_cast<int64_t>(kept.record->size());
      const size_t datagrams = 1 + kept.plain_bytes() / static_cast<size_t>(options_.part_bytes);
      budget -= static_cast<int>(datagrams);
      ++next_seq_;
      continue;
    }
    if (next_part_ == 0) out->push_back({kept.channel, kept.record, true});  // the tap for spy and logger
    SendPart(next_seq_, next_part_, now_ns, out);
    ++parts_sent;
    --budget;
    if (++next_part_ == NumParts(kept)) {
      ++next_seq_;
      next_part_ = 0;
    }
  }
  return budget;
}

void SendWindow::SendPart(int64_t seq, int64_t part_index, int64_t now_ns, std::vector<Outgoing>* out) {
  Kept& kept = at(seq);
  Cut(kept);
  if (kept.part_sent_ns.empty()) {
    kept.part_sent_ns.assign(static_cast<size_t>(NumParts(kept)), INT64_MIN / 2);
  }
  kept.part_sent_ns[static_cast<size_t>(part_index)] = now_ns;

  part_t part{};
  part.utime = now_ns / 1000;
  part.stream_key = stream_key_;
  part.seq = seq;
  part.total_bytes = static_cast<int32_t>(kept.content.size());
  part.offset = static_cast<int32_t>(part_index) * options_.part_bytes;
  part.num_bytes = std::min(options_.part_bytes, part.total_bytes - part.offset);
  const auto begin = kept.content.begin() + part.offset;
  part.data.assign(begin, begin + part.num_bytes);
  auto bytes = std::make_shared<const Bytes>(EncodePart(part));
  bytes_sent += static_cast<int64_t>(bytes->size());
  out->push_back({options_.part_channel, std::move(bytes), false});
}

}  // namespace dmslam
