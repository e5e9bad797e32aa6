#include "dmslam/place_recognition/keyframe_database.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

bool BetterScore(const PlaceCandidate& a, const PlaceCandidate& b) {
  return std::tuple(-a.score, a.keyframe) < std::tuple(-b.score, b.keyframe);
}

bool BetterGroup(const PlaceCandidate& a, const PlaceCandidate& b) {
  return std::tuple(-a.group_score, a.keyframe) < std::tuple(-b.group_score, b.keyframe);
}

}  // namespace

void KeyframeDatabaseOptions::Check() const {
  const auto share = [](double value) { return value >= 0.0 && value <= 1.0; };
  if (!share(min_common_share)) throw InputError("places: min_common_share must lie in 0..1");
  if (!share(min_group_share)) throw InputError("places: min_group_share must lie in 0..1");
  if (max_scored == 0) throw InputError("places: max_scored must be at least 1");
}

KeyframeDatabase::KeyframeDatabase(KeyframeDatabaseOptions options, size_t words)
    : options_(options), postings_(words) {
  options_.Check();
}

void KeyframeDatabase::Add(KeyframeId id, BowVector words) {
  DMSLAM_CHECK(id.valid(), "a keyframe needs an id");
  Remove(id);
  Slot slot = static_cast<Slot>(entries_.size());
  if (free_slots_.empty()) {
    entries_.emplace_back();
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  for (const WordWeight& item : words) {
    if (item.word >= postings_.size()) postings_.resize(size_t{item.word} + 1);
    postings_[item.word].push_back(slot);
  }
  entries_[slot] = {id, std::move(words)};
  slot_of_.emplace(id, slot);
}

bool KeyframeDatabase::Remove(KeyframeId id) {
  const auto found = slot_of_.find(id);
  if (found == slot_of_.end()) return false;
  const Slot slot = found->second;
  for (const WordWeight& item : entries_[slot].words) {
    auto& list = postings_[item.word];
    *std::find(list.rbegin(), list.rend(), slot) = list.back();  // most that go came late
    list.pop_back();
    if (list.capacity() > 2 * list.size() + 2) list.shrink_to_fit();  // most words are rare
  }
  entries_[slot] = {};
  free_slots_.push_back(slot);
  slot_of_.erase(found);
  return true;
}

void KeyframeDatabase::Clear() {
  entries_.clear();
  free_slots_.clear();
  slot_of_.clear();
  for (std::vector<Slot>& list : postings_) list = {};
}

const BowVector* KeyframeDatabase::Find(KeyframeId id) const {
  const auto found = slot_of_.find(id);
  return found == slot_of_.end() ? nullptr : &entries_[found->second].words;
}

std::vector<uint16_t> KeyframeDatabase::CountCommon(const BowVector& words) const {
  std::vector<std::pair<size_t, WordIndex>> by_rarity;
  by_rarity.reserve(words.size());
  for (const WordWeight& item : words) {
    if (item.word < postings_.size() && !postings_[item.word].empty()) {
      by_rarity.emplace_back(postings_[item.word].size(), item.word);
    }
  }
  std::sort(by_rarity.begin(), by_rarity.end());
  std::vector<uint16_t> common(entries_.size(), 0);
  size_t read = 0;
  for (const auto& [length, word] : by_rarity) {
    read += length;
    if (options_.max_postings > 0 && read > options_.max_postings) break;
    for (const Slot slot : postings_[word]) ++common[slot];
  }
  return common;
}

std::vector<PlaceCandidate> KeyframeDatabase::Score(const BowVector& words, const PlaceQuery& query) const {
  const std::vector<uint16_t> common = CountCommon(words);
  // Keyframes with most words in common first (ties: the newer one, whatever its slot), as if none had more
  // words than the query: who has twice the words has twice as many in common by chance. Exclusion is asked
  // only of those that could matter.
  std::vector<std::tuple<double, KeyframeId, Slot>> sharing;
  for (Slot slot = 0; slot < common.size(); ++slot) {
    if (common[slot] == 0) continue;
    const double excess = static_cast<double>(std::max(entries_[slot].words.size(), words.size())) /
                          static_cast<double>(words.size());
    sharing.emplace_back(common[slot] / excess, entries_[slot].id, slot);
  }
  std::vector<PlaceCandidate> scored;
  std::make_heap(sharing.begin(), sharing.end());
  double most = 0;
  while (!sharing.empty() && scored.size() < options_.max_scored) {
    std::pop_heap(sharing.begin(), sharing.end());
    const auto [rank, id, slot] = sharing.back();
    sharing.pop_back();
    if (rank < options_.min_common_share * most) break;
    const Entry& entry = entries_[slot];
    if (query.excluded && query.excluded(entry.id)) continue;
    most = std::max(most, rank);
    const double score = L1Score(words, entry.words);
    if (score >= query.min_score) scored.push_back({entry.id, score, score, common[slot]});
  }
  std::sort(scored.begin(), scored.end(),
            [](const PlaceCandidate& a, const PlaceCandidate& b) { return a.keyframe < b.keyframe; });
  return scored;
}

std::vector<PlaceCandidate> KeyframeDatabase::Group(const std::vector<PlaceCandidate>& scored,
                                                    const PlaceQuery& query) const {
  std::vector<PlaceCandidate> groups;
  for (const PlaceCandidate& centre : scored) {
    PlaceCandidate best = centre;
    double sum = centre.score;
    auto neighbours = query.neighbours ? query.neighbours(centre.keyframe) : std::vector<KeyframeId>{};
    if (neighbours.size() > options_.group_size) neighbours.resize(options_.group_size);
    for (const KeyframeId neighbour : neighbours) {
      const auto found = std::lower_bound(
          scored.begin(), scored.end(), neighbour,
          [](const PlaceCandidate& candidate, KeyframeId id) { return candidate.keyframe < id; });
      if (found == scored.end() || found->keyframe != neighbour || neighbour == centre.keyframe) continue;
      sum += found->score;
      if (BetterScore(*found, best)) best = *found;
    }
    best.group_score = sum;
    groups.push_back(best);
  }
  return groups;
}

std::vector<PlaceCandidate> KeyframeDatabase::Query(const BowVector& words, const PlaceQuery& query) const {
  std::vector<PlaceCandidate> groups = Group(Score(words, query), query);
  std::sort(groups.begin(), groups.end(), BetterGroup);
  std::vector<PlaceCandidate> kept;
  for (const PlaceCandidate& group : groups) {
    if (group.group_score < options_.min_group_share * groups.front().group_score) break;
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const PlaceCandidate& other) {
      return other.keyframe == group.keyframe;
    });
    if (!known) kept.push_back(group);
  }
  return kept;
}

}  // namespace dmslam
