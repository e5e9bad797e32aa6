#include "dmslam/place_recognition/vocabulary.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <string>

#include "dmslam/place_recognition/places_test_util.h"
#include "dmslam/place_recognition/vocabulary_format.h"
#include "dmslam/place_recognition/vocabulary_trainer.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using places_test::SmallVocabulary;
using places_test::SyntheticWorld;

class VocabularyTest : public testing::Test {
 protected:
  VocabularyTest()
      : folder_(fs::temp_directory_path() / ("dmslam_vocabulary_test_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~VocabularyTest() override { fs::remove_all(folder_); }

  fs::path Path(const std::string& name) const { return folder_ / name; }

  static std::string Read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  fs::path Write(const std::string& bytes) const {
    const fs::path path = Path("hostile");
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  /// The message with which loading these bytes is refused; it must name the file and a cure.
  std::string Refusal(const std::string& bytes) const {
    const fs::path path = Write(bytes);
    try {
      Vocabulary::Load(path);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind(path.string(), 0), 0U) << error.what();
      EXPECT_NE(std::string(error.what()).find(';'), std::string::npos) << "no cure: " << error.what();
      return error.what();
    }
    return "";
  }
  std::string BinaryBytes(const Vocabulary& vocabulary) const {
    vocabulary.SaveBinary(Path("bytes.dmv"));
    return Read(Path("bytes.dmv"));
  }
  std::string TextBytes(const Vocabulary& vocabulary) const {
    vocabulary.SaveText(Path("bytes.txt"));
    return Read(Path("bytes.txt"));
  }

  fs::path folder_;
};

void ExpectEqual(const Vocabulary& a, const Vocabulary& b) {
  EXPECT_EQ(a.checksum(), b.checksum());
  EXPECT_EQ(a.branching(), b.branching());
  EXPECT_EQ(a.levels(), b.levels());
  EXPECT_TRUE(std::ranges::equal(a.child_counts(), b.child_counts()));
  EXPECT_TRUE(std::ranges::equal(a.descriptors(), b.descriptors()));
  EXPECT_TRUE(std::ranges::equal(a.weights(), b.weights()));
}

/// The path from the root to a word by definition: the nearest child at every step, the first of several.
std::vector<NodeIndex> DescendByDefinition(const Vocabulary& vocabulary, const Descriptor& descriptor) {
  std::vector<NodeIndex> path = {0};
  while (!vocabulary.is_leaf(path.back())) {
    const NodeIndex first = vocabulary.first_child(path.back());
    NodeIndex best = first;
    for (NodeIndex child = first; child < first + vocabulary.child_counts()[path.back()]; ++child) {
      const auto distance = [&](NodeIndex node) {
        return HammingDistance(descriptor, vocabulary.descriptors()[node]);
      };
      if (distance(child) < distance(best)) best = child;
    }
    path.push_back(best);
  }
  return path;
}

TEST_F(VocabularyTest, TransformEqualsDescentByDefinitionOnEveryPath) {
  const Vocabulary vocabulary = SmallVocabulary();
  SyntheticWorld world(400, 7);
  auto image = world.Image(30, 300, 30);
  Random random(3);
  for (int i = 0; i < 200; ++i) image.push_back(places_test::RandomDescriptor(random));
  for (const HammingPath path :
       {HammingPath::kBest, HammingPath::kPortable, HammingPath::kPopcnt, HammingPath::kAvx2}) {
    if (!HasHammingPath(path)) continue;
    const Vocabulary on_path = vocabulary.WithPath(path);
    const auto words = on_path.Quantize(image);
    const BowImage bow = on_path.Transform(image, 2);
    ASSERT_EQ(bow.nodes.size(), image.size());
    for (const GroupedFeature& item : bow.nodes) {
      const auto expected = DescendByDefinition(vocabulary, image[item.feature]);
      EXPECT_EQ(item.group, expected[std::min<size_t>(2, expected.size() - 1)]);
      EXPECT_EQ(words[item.feature], vocabulary.word_of_leaf(expected.back()));
    }
    EXPECT_TRUE(std::ranges::is_sorted(bow.nodes));
  }
}

TEST_F(VocabularyTest, WordsAreTfIdfOfSumOne) {
  const Vocabulary vocabulary = SmallVocabulary();
  SyntheticWorld world(400, 7);
  const auto image = world.Image(0, 200, 10);
  const BowVector words = vocabulary.Transform(image).words;
  std::vector<double> expected(vocabulary.num_words(), 0.0);
  double expected_sum = 0;
  for (const WordIndex word : vocabulary.Quantize(image)) {
    expected[word] += static_cast<double>(vocabulary.weight(word));
    expected_sum += static_cast<double>(vocabulary.weight(word));
  }
  double sum = 0;
  for (const WordWeight& item : words) {
    EXPECT_NEAR(static_cast<double>(item.weight), expected[item.word] / expected_sum, 1e-7);
    EXPECT_GT(item.weight, 0.0F);
    sum += static_cast<double>(item.weight);
  }
  EXPECT_NEAR(sum, 1.0, 1e-6);
  EXPECT_TRUE(std::ranges::is_sorted(words));
  EXPECT_TRUE(vocabulary.Transform({}).words.empty());
  EXPECT_TRUE(vocabulary.Transform({}).nodes.empty());
}

TEST_F(VocabularyTest, WhatIsNotCountedIsInTheDirectIndexAlone) {
  const Vocabulary vocabulary = SmallVocabulary();
  SyntheticWorld world(400, 7);
  const auto image = world.Image(0, 100, 10);
  std::vector<uint8_t> counted(image.size(), 1);
  std::fill(counted.begin() + 40, counted.end(), uint8_t{0});
  const BowImage some = vocabulary.Transform(image, 1, counted);
  EXPECT_EQ(some.words, vocabulary.Transform(std::span(image).first(40)).words);
  EXPECT_EQ(some.nodes, vocabulary.Transform(image, 1).nodes);
  EXPECT_TRUE(vocabulary.Transform(image, 1, std::vector<uint8_t>(image.size(), 0)).words.empty());
  EXPECT_THROW(vocabulary.Transform(image, 1, std::span(counted).first(3)), InvariantError);
}

TEST_F(VocabularyTest, DirectIndexLevelsRunFromRootToLeaf) {
  const Vocabulary vocabulary = SmallVocabulary();
  SyntheticWorld world(400, 7);
  const auto image = world.Image(0, 50, 10);
  for (const GroupedFeature& item : vocabulary.Transform(image, 0).nodes) EXPECT_EQ(item.group, 0U);
  for (const GroupedFeature& item : vocabulary.Transform(image, 99).nodes)
    EXPECT_TRUE(vocabulary.is_leaf(item.group));
}

TEST_F(VocabularyTest, TrainingIsDeterministicUnderItsSeed) {
  ExpectEqual(SmallVocabulary(1), SmallVocabulary(1));
  EXPECT_NE(SmallVocabulary(1).checksum(), SmallVocabulary(2).checksum());
}

TEST_F(VocabularyTest, TrainingSeparatesKindsOfCorner) {
  // Far more room than kinds: a disturbed corner must fall where its kind does, nearly always.
  SyntheticWorld world(60, 11);
  VocabularyTrainingOptions options;
  options.branching = 8;
  options.levels = 3;
  options.min_split = 150;  // each kind occurs about 100 times
  const Vocabulary vocabulary = TrainVocabulary(world.Training(200, 30), options);
  const auto clean = vocabulary.Quantize(world.Image(0, 60, 0));
  const auto disturbed = vocabulary.Quantize(world.Image(0, 60, 12));
  int same = 0;
  for (size_t i = 0; i < clean.size(); ++i) same += clean[i] == disturbed[i];
  EXPECT_GE(same, 55);
  EXPECT_GE(std::set<WordIndex>(clean.begin(), clean.end()).size(), 45U);
}

TEST_F(VocabularyTest, CommonWordsWeighLess) {
  // One corner is in every image, another in one of 50: log(50 / 50) = 0 and log(50 / 1).
  Random random(5);
  const Descriptor everywhere = places_test::RandomDescriptor(random);
  const Descriptor once = places_test::RandomDescriptor(random);
  TrainingSet training;
  for (int i = 0; i < 50; ++i) {
    std::vector<Descriptor> image = {everywhere};
    if (i == 20) image.push_back(once);
    training.AddImage(image);
  }
  const Vocabulary vocabulary = TrainVocabulary(training, {});
  const auto words = vocabulary.Quantize(std::vector{everywhere, once});
  EXPECT_EQ(vocabulary.weight(words[0]), 0.0F);
  EXPECT_NEAR(static_cast<double>(vocabulary.weight(words[1])), std::log(50.0), 1e-6);
  const BowImage bow = vocabulary.Transform(std::vector{everywhere, once});
  EXPECT_EQ(bow.words.size(), 1U);
  EXPECT_EQ(bow.nodes.size(), 2U);
}

TEST_F(VocabularyTest, TrainingRefusesWhatCannotBeTrained) {
  EXPECT_THROW(TrainVocabulary({}, {}), InputError);
  TrainingSet one;
  one.AddImage(std::vector<Descriptor>(50));
  EXPECT_THROW(TrainVocabulary(one, {}), InputError);
  VocabularyTrainingOptions options;
  options.branching = 1;
  EXPECT_THROW(TrainVocabulary(one, options), InputError);
}

TEST_F(VocabularyTest, BothFormatsGiveTheVocabularyBack) {
  const Vocabulary vocabulary = SmallVocabulary();
  vocabulary.SaveBinary(Path("v.dmv"));
  vocabulary.SaveText(Path("v.txt"));
  const Vocabulary from_binary = Vocabulary::Load(Path("v.dmv"));
  const Vocabulary from_text = Vocabulary::Load(Path("v.txt"));
  ExpectEqual(vocabulary, from_binary);
  ExpectEqual(vocabulary, from_text);
  SyntheticWorld world(400, 7);
  const auto image = world.Image(5, 100, 20);
  EXPECT_EQ(vocabulary.Transform(image).words, from_binary.Transform(image).words);
  EXPECT_EQ(vocabulary.Transform(image).nodes, from_text.Transform(image).nodes);
  const Vocabulary copy = from_binary;  // copies outlive what they were made of
  EXPECT_EQ(copy.Quantize(image), vocabulary.Quantize(image));
}

TEST_F(VocabularyTest, ReadsTextWithNodesInDepthFirstOrder) {
  // As DBoW2 writes it: the children of a node together, then what is below each; two blanks here and there.
  const auto line = [](int parent, int leaf, int byte, const std::string& weight) {
    std::ostringstream text;
    text << parent << ' ' << leaf << ' ' << byte;
    for (int i = 1; i < 32; ++i) text << " 0";
    text << "  " << weight << '\n';
    return text.str();
  };
  const std::string text = "10 2  0 0\n" + line(0, 0, 1, "0") + line(0, 0, 255, "0") + line(1, 1, 3, "1.5") +
                           line(1, 1, 5, "0.25") + line(2, 1, 240, "2e-1") + line(2, 1, 15, "4");
  const Vocabulary vocabulary = Vocabulary::Load(Write(text));
  EXPECT_EQ(vocabulary.num_words(), 4U);
  EXPECT_EQ(vocabulary.num_nodes(), 7U);
  EXPECT_EQ(vocabulary.descriptors()[3].words[0], 3U);
  EXPECT_FLOAT_EQ(vocabulary.weight(0), 1.5F);
  EXPECT_FLOAT_EQ(vocabulary.weight(2), 0.2F);
  EXPECT_EQ(vocabulary.Quantize(std::vector{Descriptor{{240, 0, 0, 0}}}).front(), 2U);
}

TEST_F(VocabularyTest, RefusesABinaryFileCutAnywhere) {
  const std::string whole = BinaryBytes(SmallVocabulary());
  std::set<size_t> lengths;
  for (size_t length = 0; length < 200; ++length) lengths.insert(length);  // header, first counts
  for (size_t length = 200; length < whole.size(); length += 257) lengths.insert(length);
  for (size_t left = 1; left < 70; ++left) lengths.insert(whole.size() - left);
  for (const size_t length : lengths) EXPECT_NE(Refusal(whole.substr(0, length)), "") << length;
  EXPECT_NE(Refusal(whole + '\0').find("too long"), std::string::npos);
  EXPECT_NE(Refusal(whole.substr(0, whole.size() - 4)).find("truncated"), std::string::npos);
}

TEST_F(VocabularyTest, RefusesABinaryFileWithAnyByteChanged) {
  const std::string whole = BinaryBytes(SmallVocabulary());
  for (size_t at = 0; at < whole.size(); at += at < 80 ? 1 : 61) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
    EXPECT_NE(Refusal(damaged), "") << "byte " << at;
  }
}

TEST_F(VocabularyTest, RefusesATextFileCutAnywhere) {
  const std::string whole = TextBytes(SmallVocabulary());
  for (size_t length = 0; length < whole.size(); length += length < 400 ? 1 : 1009) {
    EXPECT_NE(Refusal(whole.substr(0, length)), "") << length;
  }
  for (size_t left = 1; left < 60; ++left) {  // within the last line, whose end is missing
    EXPECT_NE(Refusal(whole.substr(0, whole.size() - left)).find("truncated"), std::string::npos) << left;
  }
}

TEST_F(VocabularyTest, RefusesTextWithHostileValues) {
  std::string bytes;
  for (int i = 0; i < 32; ++i) bytes += " 7";
  const std::string leaf = "0 1" + bytes + " 1\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"hello\n", "k"},
      {"10\n", "L"},
      {"10 6 1 0\n" + leaf, "scoring"},
      {"10 6 0 3\n" + leaf, "weighting"},
      {"1 6 0 0\n" + leaf, "k"},
      {"999999999999 6 0 0\n" + leaf, "k"},
      {"10 11 0 0\n" + leaf, "L"},
      {"10 -1 0 0\n" + leaf, "L"},
      {"10 6 0 0 0\n" + leaf, "more fields"},
      {"10 6 0 0\n7 1" + bytes + " 1\n", "parent"},
      {"10 6 0 0\n-1 1" + bytes + " 1\n", "parent"},
      {"10 6 0 0\n0 2" + bytes + " 1\n", "is_leaf"},
      {"10 6 0 0\n0 1 256" + bytes.substr(2) + " 1\n", "descriptor"},
      {"10 6 0 0\n0 1 x" + bytes.substr(2) + " 1\n", "descriptor"},
      {"10 6 0 0\n0 1" + bytes + " -1\n", "weight"},
      {"10 6 0 0\n0 1" + bytes + " nan\n", "weight"},
      {"10 6 0 0\n0 1" + bytes + " inf\n", "weight"},
      {"10 6 0 0\n0 1" + bytes + "\n", "weight"},
      {"10 6 0 0\n0 1" + bytes + " 1 1\n", "more fields"},
      {"10 6 0 0\n" + leaf + "1 1" + bytes + " 1\n", "leaf as parent"},
      {"10 6 0 0\n" + leaf + "0 0" + bytes + " 1\n", "no children"},
      {"2 6 0 0\n" + leaf + leaf + leaf, "more than k"},
      {"10 6 0 0\n" + leaf, "nodes"},
      {"10 6 0 0\n", "nodes"},
      {"10 1 0 0\n" + leaf + "0 0" + bytes + " 0\n2 1" + bytes + " 1\n", "deeper"},
  };
  for (const auto& [text, expected] : cases) {
    EXPECT_NE(Refusal(text).find(expected), std::string::npos) << text << " -> " << Refusal(text);
  }
}

TEST_F(VocabularyTest, RefusesTreesThatAreNone) {
  const auto broken = [](const std::function<void(VocabularyTree&)>& damage) {
    VocabularyTree tree;
    tree.branching = 2;
    tree.levels = 2;
    tree.child_counts = {2, 0, 2, 0, 0};
    tree.descriptors.resize(5);
    tree.weights = {1, 1, 1};
    damage(tree);
    EXPECT_THROW(Vocabulary{std::move(tree)}, InputError);
  };
  broken([](VocabularyTree& tree) { tree.child_counts[0] = 3; });
  broken([](VocabularyTree& tree) { tree.child_counts[0] = 1; });
  broken([](VocabularyTree& tree) { tree.child_counts[4] = 2; });
  broken([](VocabularyTree& tree) { tree.child_counts[2] = 0; });
  broken([](VocabularyTree& tree) { tree.child_counts = {0, 0, 2, 2, 0}; });
  broken([](VocabularyTree& tree) { tree.levels = 1; });
  broken([](VocabularyTree& tree) { tree.levels = 0; });
  broken([](VocabularyTree& tree) { tree.branching = 65; });
  broken([](VocabularyTree& tree) { tree.weights.pop_back(); });
  broken([](VocabularyTree& tree) { tree.weights[1] = -1; });
  broken([](VocabularyTree& tree) { tree.weights[1] = std::numeric_limits<float>::quiet_NaN(); });
  broken([](VocabularyTree& tree) { tree.descriptors.pop_back(); });
}

TEST_F(VocabularyTest, RefusesVocabulariesOfOtherDescriptors) {
  const auto with_id = [&](uint32_t id) {
    VocabularyTree tree;
    tree.branching = 2;
    tree.levels = 1;
    tree.descriptor_id = id;
    tree.child_counts = {2, 0, 0};
    tree.descriptors.resize(3);
    tree.weights = {1, 1};
    Vocabulary(std::move(tree)).SaveBinary(Path("id.dmv"));
    return Path("id.dmv");
  };
  EXPECT_EQ(LoadOrbVocabulary(with_id(OrbDescriptorId())).descriptor_id(), OrbDescriptorId());
  EXPECT_EQ(LoadOrbVocabulary(with_id(0)).descriptor_id(), 0U);
  const fs::path other = with_id(OrbDescriptorId() ^ 1U);
  EXPECT_THROW(LoadOrbVocabulary(other), InputError);
  EXPECT_EQ(Vocabulary::Load(other).checksum(), Vocabulary::Load(with_id(0)).checksum());
}

TEST_F(VocabularyTest, TheShippedVocabularyFitsTheExtractor) {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  if (source == nullptr) GTEST_SKIP() << "DMSLAM_SOURCE_DIR is not set";
  const fs::path path = fs::path(source) / "data/vocabulary.dmv";
  ASSERT_TRUE(fs::exists(path)) << "scripts/train_vocabulary.sh makes it";
  EXPECT_LE(fs::file_size(path), 4U << 20);
  const Vocabulary vocabulary = LoadOrbVocabulary(path);
  EXPECT_EQ(vocabulary.descriptor_id(), OrbDescriptorId());
  EXPECT_GT(vocabulary.num_words(), 50000U);
}

TEST_F(VocabularyTest, NamesFilesThatCannotBeReadOrWritten) {
  EXPECT_THROW(Vocabulary::Load(Path("absent.dmv")), InputError);
  EXPECT_THROW(Vocabulary::Load(folder_), InputError);
  EXPECT_THROW(SmallVocabulary().SaveBinary(Path("no/such/folder/v.dmv")), InputError);
  EXPECT_THROW(SmallVocabulary().SaveText(Path("no/such/folder/v.txt")), InputError);
}

}  // namespace
}  // namespace dmslam
