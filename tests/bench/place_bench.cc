// Vocabulary transform, loading, score, and queries among 1k, 3k and 10k keyframes, on the shipped vocabulary
// where it is found (DMSLAM_SOURCE_DIR, default the working directory), else on a random tree of the same
// shape.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/place_recognition/keyframe_database.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// 10 children, 5 levels, 10^5 words; children differ from their parent by some 40 bits.
Vocabulary RandomVocabulary() {
  Random random(1);
  VocabularyTree tree;
  tree.branching = 10;
  tree.levels = 5;
  tree.descriptors.emplace_back();
  size_t begin = 0;
  for (uint32_t level = 0; level <= tree.levels; ++level) {
    const size_t end = tree.descriptors.size();
    for (size_t node = begin; node < end; ++node) {
      tree.child_counts.push_back(level < tree.levels ? 10 : 0);
      for (int child = 0; level < tree.levels && child < 10; ++child) {
        Descriptor descriptor = tree.descriptors[node];
        for (int i = 0; i < 40; ++i) descriptor.words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
        tree.descriptors.push_back(descriptor);
      }
    }
    begin = end;
  }
  for (int word = 0; word < 100000; ++word)
    tree.weights.push_back(static_cast<float>(random.Uniform(2.0, 7.0)));
  return Vocabulary(std::move(tree));
}

Vocabulary AnyVocabulary() {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  const auto path = std::filesystem::path(source != nullptr ? source : ".") / "data/vocabulary.dmv";
  return std::filesystem::exists(path) ? Vocabulary::Load(path) : RandomVocabulary();
}

/// 1000 descriptors near those of random leaves.
std::vector<Descriptor> RandomImage(const Vocabulary& vocabulary, Random& random) {
  std::vector<Descriptor> image;
  while (image.size() < 1000) {
    const NodeIndex node = random.Below(static_cast<uint32_t>(vocabulary.num_nodes()));
    if (!vocabulary.is_leaf(node)) continue;
    Descriptor descriptor = vocabulary.descriptors()[node];
    for (int i = 0; i < 20; ++i) descriptor.words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
    image.push_back(descriptor);
  }
  return image;
}

void BM_Transform(benchmark::State& state) {
  const auto path = static_cast<HammingPath>(state.range(0));
  if (!HasHammingPath(path)) {
    state.SkipWithError("this CPU lacks the instructions");
    return;
  }
  const Vocabulary vocabulary = AnyVocabulary().WithPath(path);
  Random random(2);
  std::vector<std::vector<Descriptor>> images;
  for (int i = 0; i < 20; ++i) images.push_back(RandomImage(vocabulary, random));
  size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(vocabulary.Transform(images[next++ % images.size()]));
}
BENCHMARK(BM_Transform)
    ->ArgName("path")
    ->Arg(static_cast<int>(HammingPath::kPortable))
    ->Arg(static_cast<int>(HammingPath::kPopcnt))
    ->Arg(static_cast<int>(HammingPath::kAvx2))
    ->Unit(benchmark::kMicrosecond);

void BM_LoadBinary(benchmark::State& state) {
  const auto path =
      std::filesystem::temp_directory_path() / ("place_bench_" + std::to_string(getpid()) + ".dmv");
  AnyVocabulary().SaveBinary(path);
  for (auto _ : state) benchmark::DoNotOptimize(Vocabulary::Load(path));
  std::filesystem::remove(path);
}
BENCHMARK(BM_LoadBinary)->Unit(benchmark::kMillisecond);

/// 700 words of 10^5, skewed as real ones are: the most common in some 15 % of the images.
BowVector SkewedWords(Random& random) {
  std::vector<WordIndex> words;
  for (int i = 0; i < 800; ++i) {
    words.push_back(static_cast<WordIndex>(99999.0 * std::pow(random.Uniform(), 2.0)));
  }
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  BowVector bow;
  for (const WordIndex word : words) bow.push_back({word, 1.0F / static_cast<float>(words.size())});
  return bow;
}

/// `bow` with a share of its words exchanged: the same place seen again.
BowVector SeenAgain(const BowVector& bow, double kept, Random& random) {
  BowVector other = SkewedWords(random);
  std::erase_if(other, [&](const WordWeight&) { return random.Uniform() < kept; });
  for (const WordWeight& item : bow) {
    if (random.Uniform() < kept) other.push_back(item);
  }
  std::sort(other.begin(), other.end());
  const auto same = [](const WordWeight& a, const WordWeight& b) { return a.word == b.word; };
  other.erase(std::unique(other.begin(), other.end(), same), other.end());
  return other;
}

/// Keyframes in runs of ten that resemble one another, as neighbours do.
void BM_Query(benchmark::State& state) {
  Random random(3);
  KeyframeDatabase database;
  std::vector<BowVector> places;
  const auto keyframes = static_cast<uint32_t>(state.range(0));
  for (uint32_t i = 0; i < keyframes; ++i) {
    if (i % 10 == 0) places.push_back(SkewedWords(random));
    database.Add(KeyframeId::Make(1, i + 1), SeenAgain(places.back(), 0.4, random));
  }
  std::vector<BowVector> queries;
  for (int i = 0; i < 50; ++i)
    queries.push_back(SeenAgain(places[random.Below(keyframes / 10)], 0.4, random));
  size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(database.Query(queries[next++ % queries.size()]));
}
BENCHMARK(BM_Query)->Arg(1000)->Arg(3000)->Arg(10000)->Unit(benchmark::kMicrosecond);

void BM_Score(benchmark::State& state) {
  Random random(4);
  const BowVector a = SkewedWords(random);
  const BowVector b = SeenAgain(a, 0.4, random);
  for (auto _ : state) benchmark::DoNotOptimize(L1Score(a, b));
}
BENCHMARK(BM_Score)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dmslam
