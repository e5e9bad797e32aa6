#include <algorithm>
#include <charconv>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/place_recognition/vocabulary_format.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"

namespace dmslam::vocabulary_format {
namespace {

/// One line of the text at a time, and the numbers on it.
class LineReader {
 public:
  LineReader(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  bool NextLine() {
    if (rest_.empty()) return false;
    ++number_;
    const size_t end = rest_.find('\n');
    if (end == std::string_view::npos) Fail("has no end: the file is truncated");
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return true;
  }

  template <typename T>
  T Number(const char* field, T low, T high) {
    SkipSpace();
    T value{};
    const auto [end, error] = std::from_chars(line_.data(), line_.data() + line_.size(), value);
    if (error != std::errc()) Fail(std::string("field ") + field + " is missing or no number");
    if (!(value >= low && value <= high)) Fail(std::string("field ") + field + " is out of range");
    line_.remove_prefix(static_cast<size_t>(end - line_.data()));
    if (!line_.empty() && !IsSpace(line_.front())) Fail(std::string("field ") + field + " is no number");
    return value;
  }

  void EndOfLine() {
    SkipSpace();
    if (!line_.empty()) Fail("has more fields than the format knows");
  }

  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(
        name_ + ": line " + std::to_string(number_) + " " + problem +
        "; give a vocabulary made by dmslam-vocab or in DBoW2's text format (scoring 0, weighting 0)");
  }

 private:
  static bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r'; }
  void SkipSpace() {
    while (!line_.empty() && IsSpace(line_.front())) line_.remove_prefix(1);
  }

  std::string_view rest_;
  std::string_view line_;
  const std::string& name_;
  size_t number_ = 0;
};

/// A node as the text has it. Node i of the file is number i + 1; the root, number 0, has no line.
struct TextNode {
  uint32_t parent = 0;
  bool leaf = false;
  Descriptor descriptor;
  float weight = 0.0F;
};

TextNode ReadNode(LineReader& reader, uint32_t own_number) {
  TextNode node;
  node.parent = reader.Number<uint32_t>("parent", 0, own_number - 1);
  node.leaf = reader.Number<int>("is_leaf", 0, 1) != 0;
  for (size_t byte = 0; byte < 32; ++byte) {
    const uint64_t value = reader.Number<uint32_t>("descriptor", 0, 255);
    node.descriptor.words[byte / 8] |= value << (8 * (byte % 8));
  }
  node.weight = static_cast<float>(reader.Number<double>("weight", 0.0, 1e6));
  reader.EndOfLine();
  return node;
}

struct TextTree {
  uint32_t branching = 0;
  uint32_t levels = 0;
  std::vector<TextNode> nodes;
};

TextTree ReadTree(LineReader& reader) {
  TextTree tree;
  if (!reader.NextLine()) reader.Fail("is missing");
  tree.branching = reader.Number<uint32_t>("k", 2, kMaxBranching);
  tree.levels = reader.Number<uint32_t>("L", 1, kMaxLevels);
  reader.Number<int>("scoring", 0, 0);
  reader.Number<int>("weighting", 0, 0);
  reader.EndOfLine();
  while (reader.NextLine()) {
    const auto number = static_cast<uint32_t>(tree.nodes.size() + 1);
    if (number >= kMaxNodes) reader.Fail("is one node too many");
    tree.nodes.push_back(ReadNode(reader, number));
    const uint32_t parent = tree.nodes.back().parent;
    if (parent > 0 && tree.nodes[parent - 1].leaf) reader.Fail("names a leaf as parent");
  }
  return tree;
}

/// Children of each node as consecutive ranges, in the order of the file.
struct Children {
  explicit Children(const TextTree& tree) : begin(tree.nodes.size() + 2, 0), members(tree.nodes.size()) {
    for (const TextNode& node : tree.nodes) ++begin[node.parent + 1];
    for (size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    std::vector<uint32_t> next = begin;
    for (uint32_t i = 0; i < tree.nodes.size(); ++i) members[next[tree.nodes[i].parent]++] = i + 1;
  }
  std::vector<uint32_t> begin;
  std::vector<uint32_t> members;
};

}  // namespace

VocabularyTree ParseText(std::string_view text, const std::string& name) {
  LineReader reader(text, name);
  const TextTree source = ReadTree(reader);
  const Children children(source);
  VocabularyTree tree;
  tree.branching = source.branching;
  tree.levels = source.levels;
  std::vector<uint32_t> order = {0};
  order.reserve(source.nodes.size() + 1);
  for (size_t i = 0; i < order.size(); ++i) {
    const uint32_t number = order[i];
    const uint32_t begin = children.begin[number];
    const uint32_t count = children.begin[number + 1] - begin;
    if (count > source.branching) reader.Fail("ends a file in which a node has more than k children");
    tree.child_counts.push_back(static_cast<uint8_t>(count));
    order.insert(order.end(), children.members.begin() + begin, children.members.begin() + begin + count);
    if (number == 0) {
      tree.descriptors.emplace_back();
      continue;
    }
    const TextNode& node = source.nodes[number - 1];
    if (!node.leaf && count == 0)
      reader.Fail("ends a file in which an inner node has no children: it is truncated");
    tree.descriptors.push_back(node.descriptor);
    if (node.leaf) tree.weights.push_back(node.weight);
  }
  return tree;
}

void WriteText(const Vocabulary& vocabulary, const std::filesystem::path& path) {
  OutputFile file(path);
  file.Write(std::to_string(vocabulary.branching()) + " " + std::to_string(vocabulary.levels()) + " 0 0\n");
  const auto nodes = static_cast<NodeIndex>(vocabulary.num_nodes());
  std::string text;
  for (NodeIndex parent = 0; parent < nodes; ++parent) {
    for (NodeIndex child = 0; child < vocabulary.child_counts()[parent]; ++child) {
      const NodeIndex node = vocabulary.first_child(parent) + child;
      const bool leaf = vocabulary.is_leaf(node);
      text = std::to_string(parent) + (leaf ? " 1" : " 0");
      for (const uint64_t word : vocabulary.descriptors()[node].words) {
        for (int byte = 0; byte < 8; ++byte) text += ' ' + std::to_string((word >> (8 * byte)) & 0xffU);
      }
      char weight[32];
      std::snprintf(weight, sizeof(weight), " %.9g\n",
                    leaf ? static_cast<double>(vocabulary.weight(vocabulary.word_of_leaf(node))) : 0.0);
      file.Write(text + weight);
    }
  }
  file.Commit();
}

}  // namespace dmslam::vocabulary_format
