#include "dmslam/place_recognition/vocabulary.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "dmslam/features/brief_pattern.h"
#include "dmslam/place_recognition/vocabulary_format.h"
#include "dmslam/util/check.h"
#include "dmslam/util/crc32c.h"
#include "dmslam/util/output_file.h"

namespace dmslam {

namespace format = vocabulary_format;

/// A whole file, read-only in memory.
class Vocabulary::Mapping {
 public:
  explicit Mapping(const std::filesystem::path& path) {
    const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    const bool good = descriptor >= 0 && fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
    size_ = good ? static_cast<size_t>(status.st_size) : 0;
    if (size_ > 0) data_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE | MAP_POPULATE, descriptor, 0);
    if (descriptor >= 0) close(descriptor);
    if (!good || data_ == MAP_FAILED) {
      data_ = nullptr;
      throw InputError(path.string() + ": vocabulary cannot be read; check the path");
    }
  }
  ~Mapping() {
    if (data_ != nullptr) munmap(data_, size_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  std::span<const uint8_t> bytes() const { return {static_cast<const uint8_t*>(data_), size_}; }
  template <typename T>
  std::span<const T> Array(size_t offset, size_t count) const {
    return {reinterpret_cast<const T*>(bytes().data() + offset), count};
  }

 private:
  void* data_ = nullptr;
  size_t size_ = 0;
};

namespace {

constexpr const char* kMakeAgain = "; make the file again (dmslam-vocab train or convert)";

[[noreturn]] void Fail(const std::string& name, const std::string& problem) {
  throw InputError(name + ": " + problem + kMakeAgain);
}

template <typename T>
std::span<const uint8_t> BytesOf(std::span<const T> values) {
  return {reinterpret_cast<const uint8_t*>(values.data()), values.size_bytes()};
}

uint32_t ChecksumOf(uint32_t branching, uint32_t levels, std::span<const uint8_t> child_counts,
                    std::span<const Descriptor> descriptors, std::span<const float> weights) {
  const std::array<uint32_t, 4> shape = {branching, levels, static_cast<uint32_t>(descriptors.size()),
                                         static_cast<uint32_t>(weights.size())};
  uint32_t crc = Crc32c(BytesOf(std::span<const uint32_t>(shape)));
  crc = Crc32c(child_counts, crc);
  crc = Crc32c(BytesOf(descriptors), crc);
  return Crc32c(BytesOf(weights), crc);
}

/// Checks everything of a header that can be checked without the rest.
void CheckHeader(const format::Header& header, size_t file_size, const std::string& name) {
  if (header.magic != format::kMagic) Fail(name, "file does not begin as a vocabulary does");
  if (header.version != format::kVersion) {
    Fail(name, "version is " + std::to_string(header.version) + ", this program reads " +
                   std::to_string(format::kVersion));
  }
  if (header.header_crc != format::HeaderCrc(header))
    Fail(name, "header's checksum does not match, file is damaged");
  if (header.branching < 2 || header.branching > format::kMaxBranching) Fail(name, "branching is not 2..64");
  if (header.levels < 1 || header.levels > format::kMaxLevels) Fail(name, "levels is not 1..10");
  if (header.num_nodes < 3 || header.num_nodes > format::kMaxNodes) Fail(name, "num_nodes is out of range");
  if (header.num_words < 2 || header.num_words >= header.num_nodes) Fail(name, "num_words is out of range");
  const size_t expected = format::Layout(header).end;
  if (file_size != expected) {
    Fail(name, "file is " + std::string(file_size < expected ? "truncated" : "too long") + " (" +
                   std::to_string(file_size) + " bytes, its header says " + std::to_string(expected) + ")");
  }
}

bool AllZero(std::span<const uint8_t> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](uint8_t byte) { return byte == 0; });
}

BowVector WeighWords(std::vector<WordIndex> words, const Vocabulary& vocabulary) {
  std::sort(words.begin(), words.end());
  BowVector result;
  result.reserve(words.size());
  double sum = 0;
  for (size_t begin = 0; begin < words.size();) {
    size_t end = begin;
    while (end < words.size() && words[end] == words[begin]) ++end;
    const float weight = static_cast<float>(end - begin) * vocabulary.weight(words[begin]);
    if (weight > 0.0F) {
      result.push_back({words[begin], weight});
      sum += static_cast<double>(weight);
    }
    begin = end;
  }
  for (WordWeight& item : result) item.weight = static_cast<float>(static_cast<double>(item.weight) / sum);
  return result;
}

}  // namespace

Vocabulary::Vocabulary(VocabularyTree tree, const std::string& name)
    : nearest_child_(NearestChildOn(HammingPath::kBest)) {
  auto shared = std::make_shared<Shared>();
  shared->owned = std::move(tree);
  const VocabularyTree& owned = shared->owned;
  shared->branching = owned.branching;
  shared->levels = owned.levels;
  shared->descriptor_id = owned.descriptor_id;
  shared->child_counts = owned.child_counts;
  shared->descriptors = owned.descriptors;
  shared->weights = owned.weights;
  CheckValues(*shared, name);
  Link(*shared, name);
  shared->checksum =
      ChecksumOf(owned.branching, owned.levels, owned.child_counts, owned.descriptors, owned.weights);
  shared_ = std::move(shared);
}

Vocabulary::Vocabulary(std::shared_ptr<const Shared> shared)
    : shared_(std::move(shared)), nearest_child_(NearestChildOn(HammingPath::kBest)) {}

Vocabulary Vocabulary::Load(const std::filesystem::path& path) {
  auto mapping = std::make_shared<const Mapping>(path);
  const auto bytes = mapping->bytes();
  if (bytes.empty()) Fail(path.string(), "file is empty");
  const auto& magic = format::kMagic;
  const size_t known = std::min(bytes.size(), magic.size());
  if (std::memcmp(bytes.data(), magic.data(), known) == 0) return FromMapping(path, std::move(mapping));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return Vocabulary(format::ParseText(text, path.string()), path.string());
}

Vocabulary Vocabulary::FromMapping(const std::filesystem::path& path,
                                   std::shared_ptr<const Mapping> mapping) {
  const std::string name = path.string();
  const auto bytes = mapping->bytes();
  format::Header header;
  if (bytes.size() < sizeof(header)) Fail(name, "file is truncated within its header");
  std::memcpy(&header, bytes.data(), sizeof(header));
  CheckHeader(header, bytes.size(), name);
  const format::Layout layout(header);
  auto shared = std::make_shared<Shared>();
  shared->branching = header.branching;
  shared->levels = header.levels;
  shared->descriptor_id = header.descriptor_id;
  shared->child_counts = mapping->Array<uint8_t>(layout.child_counts, header.num_nodes);
  shared->descriptors = mapping->Array<Descriptor>(layout.descriptors, header.num_nodes);
  shared->weights = mapping->Array<float>(layout.weights, header.num_words);
  shared->checksum =
      ChecksumOf(header.branching, header.levels, shared->child_counts, shared->descriptors, shared->weights);
  const size_t counts_end = layout.child_counts + header.num_nodes;
  const bool padding_zero = AllZero(bytes.subspan(counts_end, layout.descriptors - counts_end));
  if (shared->checksum != header.checksum || !padding_zero)
    Fail(name, "checksum does not match, file is damaged");
  CheckValues(*shared, name);
  Link(*shared, name);
  shared->mapping = std::move(mapping);
  return Vocabulary(std::shared_ptr<const Shared>(std::move(shared)));
}

void Vocabulary::CheckValues(const Shared& shared, const std::string& name) {
  if (shared.branching < 2 || shared.branching > format::kMaxBranching) Fail(name, "branching is not 2..64");
  if (shared.levels < 1 || shared.levels > format::kMaxLevels) Fail(name, "levels is not 1..10");
  const size_t nodes = shared.descriptors.size();
  if (nodes < 3 || nodes > format::kMaxNodes || shared.child_counts.size() != nodes) {
    Fail(name, "number of nodes is out of range");
  }
  for (const float weight : shared.weights) {
    if (!std::isfinite(weight) || weight < 0.0F) Fail(name, "a word's weight is negative or not a number");
  }
}

void Vocabulary::Link(Shared& shared, const std::string& name) {
  const size_t nodes = shared.descriptors.size();
  shared.links.resize(nodes);
  size_t next_child = 1;
  uint32_t next_word = 0;
  size_t level_end = 1;  // first node of the next level
  uint32_t level = 0;
  for (size_t node = 0; node < nodes; ++node) {
    if (node == level_end) {
      level_end = next_child;
      ++level;
    }
    if (node >= next_child) Fail(name, "node " + std::to_string(node) + " has no parent");
    const uint8_t count = shared.child_counts[node];
    if (count > shared.branching) Fail(name, "node " + std::to_string(node) + " has too many children");
    if (count > 0 && level >= shared.levels) Fail(name, "tree is deeper than its header says");
    shared.links[node] = count > 0 ? static_cast<uint32_t>(next_child) : next_word++;
    next_child += count;
  }
  if (next_child != nodes) Fail(name, "nodes are missing");
  if (next_word != shared.weights.size()) Fail(name, "number of weights is not the number of words");
}

void Vocabulary::SaveBinary(const std::filesystem::path& path) const {
  format::Header header;
  header.branching = branching();
  header.levels = levels();
  header.num_nodes = static_cast<uint32_t>(num_nodes());
  header.num_words = static_cast<uint32_t>(num_words());
  header.checksum = checksum();
  header.descriptor_id = descriptor_id();
  header.header_crc = format::HeaderCrc(header);
  const format::Layout layout(header);
  const std::vector<std::byte> padding(layout.descriptors - layout.child_counts - num_nodes());
  OutputFile file(path);
  file.Write(std::as_bytes(std::span(&header, 1)));
  file.Write(std::as_bytes(child_counts()));
  file.Write(padding);
  file.Write(std::as_bytes(descriptors()));
  file.Write(std::as_bytes(weights()));
  file.Commit();
}

void Vocabulary::SaveText(const std::filesystem::path& path) const { format::WriteText(*this, path); }

void Vocabulary::Save(const std::filesystem::path& path) const {
  if (path.extension() == ".txt") {
    SaveText(path);
  } else {
    SaveBinary(path);
  }
}

void Vocabulary::Descend(std::span<const Descriptor> features, std::vector<NodeIndex>& leaves, int level,
                         std::vector<NodeIndex>* at_level) const {
  // Level by level over all features, so that the children of the next ones are on their way while one is
  // compared.
  constexpr size_t kAhead = 6;
  const Shared& tree = *shared_;
  leaves.assign(features.size(), 0);
  for (int step = 0; step <= static_cast<int>(tree.levels); ++step) {
    if (at_level != nullptr && step == level) *at_level = leaves;
    bool moved = false;
    for (size_t i = 0; i < features.size(); ++i) {
      if (i + kAhead < features.size()) {
        const NodeIndex ahead = leaves[i + kAhead];
        if (!is_leaf(ahead)) {
          const auto* lines = reinterpret_cast<const char*>(&tree.descriptors[tree.links[ahead]]);
          for (int line = 0; line < 5; ++line) __builtin_prefetch(lines + 64 * line);
        }
      }
      const NodeIndex node = leaves[i];
      const int count = tree.child_counts[node];
      if (count == 0) continue;
      const NodeIndex child = tree.links[node];
      leaves[i] =
          child + static_cast<NodeIndex>(nearest_child_(features[i], &tree.descriptors[child], count));
      moved = true;
    }
    if (!moved) break;
  }
  if (at_level != nullptr && at_level->size() != features.size()) *at_level = leaves;
}

std::vector<WordIndex> Vocabulary::Quantize(std::span<const Descriptor> features) const {
  std::vector<NodeIndex> nodes;
  Descend(features, nodes, 0, nullptr);
  for (NodeIndex& node : nodes) node = word_of_leaf(node);
  return nodes;
}

BowImage Vocabulary::Transform(std::span<const Descriptor> features, int node_level,
                               std::span<const uint8_t> counted) const {
  DMSLAM_CHECK(counted.empty() || counted.size() == features.size(), "one flag per descriptor, or none");
  DMSLAM_CHECK(node_level >= 0, "levels are counted from the root, which is 0");
  std::vector<NodeIndex> leaves;
  std::vector<NodeIndex> at_level;
  Descend(features, leaves, node_level, &at_level);
  BowImage image;
  image.nodes.reserve(features.size());
  for (uint32_t i = 0; i < features.size(); ++i) image.nodes.push_back({at_level[i], i});
  std::sort(image.nodes.begin(), image.nodes.end());
  std::vector<WordIndex> words;
  words.reserve(leaves.size());
  for (size_t i = 0; i < leaves.size(); ++i) {
    if (counted.empty() || counted[i] != 0) words.push_back(word_of_leaf(leaves[i]));
  }
  image.words = WeighWords(std::move(words), *this);
  return image;
}

Vocabulary Vocabulary::WithPath(HammingPath path) const {
  Vocabulary other = *this;
  other.nearest_child_ = NearestChildOn(path);
  return other;
}

uint32_t OrbDescriptorId() {
  const auto& pattern = BriefPattern();
  return Crc32c({reinterpret_cast<const uint8_t*>(pattern.data()), pattern.size() * sizeof(pattern[0])});
}

Vocabulary LoadOrbVocabulary(const std::filesystem::path& path) {
  Vocabulary vocabulary = Vocabulary::Load(path);
  if (vocabulary.descriptor_id() != 0 && vocabulary.descriptor_id() != OrbDescriptorId()) {
    throw InputError(path.string() +
                     ": vocabulary was trained on other descriptors than this program makes; " +
                     "train it again (scripts/train_vocabulary.sh)");
  }
  return vocabulary;
}

}  // namespace dmslam
