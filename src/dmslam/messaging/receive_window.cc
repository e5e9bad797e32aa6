#include "dmslam/messaging/receive_window.h"

#include <algorithm>

#include "dmslam/messaging/packing.h"

namespace dmslam {

void ReceiveWindow::Reset(int64_t next) {
  *this = ReceiveWindow(limits_);
  next_ = next;
  received_ = newest_ = sent_ = next - 1;
}

void ReceiveWindow::Expose(int64_t seq) {
  sent_ = std::max(sent_, seq);
  newest_ = std::max(newest_, seq);
}

void ReceiveWindow::Retract(int64_t seq) {
  newest_ = std::max(seq, next_ - 1);
  sent_ = std::min(sent_, newest_);
  received_ = std::min(received_, newest_);
  for (auto it = whole_.upper_bound(newest_); it != whole_.end(); it = whole_.erase(it))
    bytes_ -= it->second.bytes->size();
  for (auto it = pieces_.upper_bound(newest_); it != pieces_.end(); it = pieces_.erase(it))
    bytes_ -= it->second.data.size();
}

int64_t ReceiveWindow::GiveUpBefore(int64_t first) {
  if (first <= received_ + 1) return 0;
  pieces_.erase(pieces_.begin(), pieces_.lower_bound(first));
  bytes_ = 0;
  for (const auto& [seq, pieces] : pieces_) bytes_ += pieces.data.size();
  int64_t here = 0;
  for (const auto& [seq, record] : whole_) {
    bytes_ += record.bytes->size();
    if (seq > received_ && seq < first) ++here;
  }
  const int64_t lost = first - 1 - received_ - here;
  given_up_before_ = first;
  received_ = first - 1;
  while (whole_.contains(received_ + 1)) ++received_;
  Expose(first - 1);
  SkipGivenUp();
  return lost;
}

void ReceiveWindow::SkipGivenUp() {
  if (next_ >= given_up_before_) return;
  next_ = whole_.empty() ? given_up_before_ : std::min(given_up_before_, whole_.begin()->first);
}

bool ReceiveWindow::HasRoomFor(int64_t seq, size_t more_bytes) const {
  // The next one in order always finds room, or nothing would ever move again.
  if (seq == received_ + 1 && more_bytes <= limits_.record_bytes) return true;
  return seq < next_ + limits_.records_ahead && bytes_ + more_bytes <= limits_.bytes;
}

void ReceiveWindow::Discard(int64_t seq) {
  const auto it = pieces_.find(seq);
  if (it == pieces_.end()) return;
  bytes_ -= it->second.data.size();
  pieces_.erase(it);
}

ReceiveWindow::Result ReceiveWindow::Add(Record record) {
  const int64_t seq = record.header.seq;
  if (IsKnown(seq)) return Result::kDuplicate;
  Discard(seq);
  const size_t size = record.bytes->size();
  newest_ = std::max(newest_, seq);
  sent_ = std::max(sent_, seq - 1);
  if (!HasRoomFor(seq, size)) return Result::kNoRoom;
  bytes_ += size;
  whole_.emplace(seq, std::move(record));
  while (whole_.contains(received_ + 1)) ++received_;
  return Result::kNew;
}

ReceiveWindow::PartResult ReceiveWindow::AddPart(const part_t& part) {
  if (IsKnown(part.seq)) return {Result::kDuplicate, {}};
  const auto total = static_cast<size_t>(part.total_bytes);
  if (total > limits_.record_bytes) return {Result::kNoRoom, {}};
  newest_ = std::max(newest_, part.seq);
  sent_ = std::max(sent_, part.seq - 1);
  auto it = pieces_.find(part.seq);
  if (it != pieces_.end() && it->second.data.size() != total) {
    Discard(part.seq);
    it = pieces_.end();
  }
  if (it == pieces_.end()) {
    if (!HasRoomFor(part.seq, total)) return {Result::kNoRoom, {}};
    it = pieces_.emplace(part.seq, Pieces{Bytes(total), {}}).first;
    bytes_ += total;
  }
  Pieces& pieces = it->second;
  std::copy(part.data.begin(), part.data.end(), pieces.data.begin() + part.offset);
  Join(part.offset, part.offset + part.num_bytes, &pieces.have);
  if (pieces.have.size() > 1 || pieces.have.begin()->first > 0 ||
      pieces.have.begin()->second < part.total_bytes) {
    return {Result::kIncomplete, {}};
  }
  PartResult result{Result::kNew, ParseContent(pieces.data, limits_.record_bytes)};
  if (!result.whole) result.whole.emplace();  // whoever looks at it finds that it is no record
  Discard(part.seq);
  return result;
}

void ReceiveWindow::Join(int32_t begin, int32_t end, std::map<int32_t, int32_t>* have) {
  auto it = have->upper_bound(begin);
  if (it != have->begin() && std::prev(it)->second >= begin) {
    --it;
    begin = it->first;
    end = std::max(end, it->second);
    it = have->erase(it);
  }
  while (it != have->end() && it->first <= end) {
    end = std::max(end, it->second);
    it = have->erase(it);
  }
  have->emplace(begin, end);
}

std::optional<Record> ReceiveWindow::Take() {
  if (!CanTake()) return std::nullopt;
  Record record = std::move(whole_.begin()->second);
  whole_.erase(whole_.begin());
  bytes_ -= record.bytes->size();
  ++next_;
  SkipGivenUp();
  return record;
}

void ReceiveWindow::PutBack() {
  --next_;
  received_ = next_ - 1;
}

std::vector<MissingRange> ReceiveWindow::Missing(size_t limit) const {
  std::vector<MissingRange> missing;
  // Only what there is room for is asked for.
  const int64_t last = std::min(newest_, next_ + limits_.records_ahead - 1);
  const bool full = bytes_ >= limits_.bytes;
  for (int64_t seq = received_ + 1; seq <= last && missing.size() < limit; ++seq) {
    if (whole_.contains(seq)) continue;
    const auto it = pieces_.find(seq);
    if (it != pieces_.end()) {
      AppendGaps(seq, it->second, limit, &missing);
    } else if (seq > sent_ || (full && seq > received_ + 1)) {
      break;
    } else if (!missing.empty() && missing.back().last_seq == seq - 1 && missing.back().end_byte == 0) {
      missing.back().last_seq = seq;
    } else {
      missing.push_back({seq, seq, 0, 0});
    }
  }
  return missing;
}

void ReceiveWindow::AppendGaps(int64_t seq, const Pieces& pieces, size_t limit,
                               std::vector<MissingRange>* missing) const {
  int32_t gap_begin = 0;
  for (const auto& [begin, end] : pieces.have) {
    if (begin > gap_begin && missing->size() < limit) missing->push_back({seq, seq, gap_begin, begin});
    gap_begin = end;
  }
  const auto total = static_cast<int32_t>(pieces.data.size());
  // The last bytes may still be on their way, unless the writer has gone on since.
  if (gap_begin < total && seq <= sent_ && missing->size() < limit) {
    missing->push_back({seq, seq, gap_begin, total});
  }
}

}  // namespace dmslam
