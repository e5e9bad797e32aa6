#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "dmslam/place_recognition/bow.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// How a KeyframeDatabase looks for places.
struct KeyframeDatabaseOptions {
  double min_common_share = 0.8;  ///< a candidate shares at least this part of the most words that any shares
                                  ///< (counted as if none had more words than the query)
  double min_group_share = 0.75;  ///< and its group scores at least this part of the best group
  size_t group_size = 10;         ///< most neighbours whose scores join a candidate's
  size_t max_scored =
      100;  ///< most keyframes that are scored exactly per query (those with most common words)
  /// Most entries of the inverted index that a query reads. It reads the words that fewest keyframes have
  /// first, and stops before the word that would exceed it: the common words, which say little, are what a
  /// large database leaves out, and a query stays bounded. 0: no bound.
  size_t max_postings = 150000;

  /// Throws InputError naming the field.
  void Check() const;
};

/// A place that looks like the query.
struct PlaceCandidate {
  KeyframeId keyframe;
  double score = 0;        ///< L1 score of the keyframe itself, 0..1
  double group_score = 0;  ///< sum of the scores of its group
  int common_words = 0;    ///< words in common with the query, of those that were read
  bool operator==(const PlaceCandidate&) const = default;
};

/// What is asked of the database.
struct PlaceQuery {
  /// Keyframes that may not be found (neighbours of the query, other maps); empty: all may.
  std::function<bool(KeyframeId)> excluded;
  /// The neighbours of a keyframe in the covisibility graph, best first; empty: every keyframe is its own
  /// group.
  std::function<std::vector<KeyframeId>(KeyframeId)> neighbours;
  double min_score = 0;  ///< keyframes that score less are not candidates
};

/// Which keyframes have which words: finds those that look like an image. The candidates of Mur-Artal,
/// Tardos, "Fast relocalisation and loop closing in keyframe-based SLAM", ICRA 2014, section III. Results
/// depend on the contents alone, not on the order in which keyframes came.
class KeyframeDatabase {
 public:
  /// `words`: of the vocabulary, if it is known. Then the first keyframes do not wait for the table of them,
  /// which is megabytes.
  explicit KeyframeDatabase(KeyframeDatabaseOptions options = {}, size_t words = 0);

  /// Adds a keyframe. Replaces its words when it is there already.
  void Add(KeyframeId id, BowVector words);
  /// Removes a keyframe; false when it is not there.
  bool Remove(KeyframeId id);
  void Clear();

  bool Contains(KeyframeId id) const { return slot_of_.contains(id); }
  size_t size() const { return slot_of_.size(); }
  /// Words of a keyframe, or null when it is not there.
  const BowVector* Find(KeyframeId id) const;

  /// Candidates, best group first (ties: older keyframe first): of each group the keyframe that scores best,
  /// once. Safe to call from several threads while nobody edits.
  std::vector<PlaceCandidate> Query(const BowVector& words, const PlaceQuery& query = {}) const;

 private:
  using Slot = uint32_t;
  struct Entry {
    KeyframeId id;
    BowVector words;
  };

  std::vector<uint16_t> CountCommon(const BowVector& words) const;
  std::vector<PlaceCandidate> Score(const BowVector& words, const PlaceQuery& query) const;
  std::vector<PlaceCandidate> Group(const std::vector<PlaceCandidate>& scored, const PlaceQuery& query) const;

  KeyframeDatabaseOptions options_;
  std::vector<Entry> entries_;  ///< by slot; free ones have an invalid id
  std::vector<Slot> free_slots_;
  std::map<KeyframeId, Slot> slot_of_;
  std::vector<std::vector<Slot>> postings_;  ///< by word: slots of the keyframes that have it, any order
};

}  // namespace dmslam
