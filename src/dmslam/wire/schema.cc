#include "dmslam/wire/schema.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <optional>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam::wire {
namespace {

struct Primitive {
  std::string_view name;
  Field::Kind kind;
  int size_bytes;
};
constexpr Primitive kPrimitives[] = {
    {"boolean", Field::Kind::kInteger, 1}, {"byte", Field::Kind::kInteger, 1},
    {"int8_t", Field::Kind::kInteger, 1},  {"int16_t", Field::Kind::kInteger, 2},
    {"int32_t", Field::Kind::kInteger, 4}, {"int64_t", Field::Kind::kInteger, 8},
    {"float", Field::Kind::kReal, 4},      {"double", Field::Kind::kReal, 8},
    {"string", Field::Kind::kString, 0},
};

[[noreturn]] void Fail(const std::string& what) { throw InvariantError("message definition: " + what); }

// Cuts a definition into words and marks; comments are kept apart, with the line they stand on.
class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}

  /// Next word or mark; empty at the end.
  std::string Next() {
    SkipSpace();
    if (at_ >= text_.size()) return {};
    const size_t begin = at_;
    if (IsWord(text_[at_])) {
      while (at_ < text_.size() && IsWord(text_[at_])) ++at_;
    } else {
      ++at_;
    }
    return std::string(text_.substr(begin, at_ - begin));
  }
  std::string Peek() {
    SkipSpace();  // what it collects belongs to what comes next
    const size_t at = at_;
    std::string word = Next();
    at_ = at;
    return word;
  }
  void Expect(std::string_view mark) {
    const std::string got = Next();
    if (got != mark) Fail("expected '" + std::string(mark) + "' and found '" + got + "'");
  }
  /// The comment on the rest of this line and on the lines below it that hold nothing else, if the comment
  /// begins on this line.
  std::string TrailingComment() {
    size_t line_end = at_;
    while (line_end < text_.size() && (text_[line_end] == ' ' || text_[line_end] == '\t')) ++line_end;
    if (text_.substr(line_end, 2) != "//") return {};
    comment_.clear();
    SkipSpace(/*stop_at_blank_line=*/true);
    return TakeComment();
  }
  /// The comment collected since the last call.
  std::string TakeComment() { return std::exchange(comment_, {}); }

 private:
  static bool IsWord(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
  }
  void SkipSpace(bool stop_at_blank_line = false) {
    int newlines = 0;
    while (at_ < text_.size()) {
      if (text_.substr(at_, 2) == "//") {
        const size_t end = std::min(text_.find('\n', at_), text_.size());
        std::string_view line = text_.substr(at_ + 2, end - at_ - 2);
        while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
        if (!comment_.empty()) comment_ += ' ';
        comment_ += line;
        at_ = end;
        newlines = 0;
      } else if (std::isspace(static_cast<unsigned char>(text_[at_])) != 0) {
        newlines += text_[at_] == '\n' ? 1 : 0;
        if (stop_at_blank_line && newlines == 2) return;
        ++at_;
      } else {
        return;
      }
    }
  }

  std::string_view text_;
  size_t at_ = 0;
  std::string comment_;
};

Field::Dimension ParseDimension(const std::string& word, const StructType& type) {
  if (!word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) != 0) return {std::stoll(word), -1};
  for (size_t i = 0; i < type.fields.size(); ++i) {
    const Field& field = type.fields[i];
    if (field.name == word && field.kind == Field::Kind::kInteger && field.dimensions.empty()) {
      return {0, static_cast<int>(i)};
    }
  }
  Fail(type.name + ": '" + word + "' does not count an array");
}

Field ParseField(const std::string& type_name, const StructType& type, Lexer& lexer) {
  Field field;
  field.type = type_name;
  field.kind = Field::Kind::kStruct;
  for (const Primitive& primitive : kPrimitives) {
    if (primitive.name != type_name) continue;
    field.kind = primitive.kind;
    field.size_bytes = primitive.size_bytes;
  }
  field.name = lexer.Next();
  while (lexer.Peek() == "[") {
    lexer.Expect("[");
    field.dimensions.push_back(ParseDimension(lexer.Next(), type));
    lexer.Expect("]");
  }
  lexer.Expect(";");
  field.comment = lexer.TrailingComment();
  return field;
}

Constant ParseConstant(Lexer& lexer) {
  Constant constant;
  constant.type = lexer.Next();
  constant.name = lexer.Next();
  lexer.Expect("=");
  constant.value = lexer.Next();
  lexer.Expect(";");
  constant.comment = lexer.TrailingComment();
  return constant;
}

StructType ParseStruct(Lexer& lexer) {
  StructType type;
  type.comment = lexer.TakeComment();
  lexer.Expect("struct");
  type.name = lexer.Next();
  lexer.Expect("{");
  for (std::string word = lexer.Next(); word != "}"; word = lexer.Next()) {
    if (word.empty()) Fail(type.name + " is not closed");
    if (word == "const") {
      type.constants.push_back(ParseConstant(lexer));
    } else {
      type.fields.push_back(ParseField(word, type, lexer));
    }
  }
  lexer.TakeComment();
  return type;
}

// Walks encoded bytes; the first fault stays.
class Walker {
 public:
  Walker(const Schema& schema, std::span<const uint8_t> bytes) : schema_(schema), bytes_(bytes) {}

  std::string Run(const StructType& type) {
    if (Struct(type) && left() != 0) fault_ = "more bytes than it has fields";
    return fault_;
  }

 private:
  size_t left() const { return bytes_.size() - at_; }

  bool Fault(const Field& field, const char* what) {
    fault_ = field.name + ": " + what;
    return false;
  }
  int64_t ReadInteger(int size_bytes) {
    uint64_t value = 0;
    for (int i = 0; i < size_bytes; ++i) value = (value << 8) | bytes_[at_ + static_cast<size_t>(i)];
    const int unused_bits = 64 - 8 * size_bytes;
    return static_cast<int64_t>(value << unused_bits) >> unused_bits;
  }
  bool String(const Field& field) {
    if (left() < 4) return Fault(field, "too short");
    const int64_t length = ReadInteger(4);
    at_ += 4;
    if (length < 1 || static_cast<uint64_t>(length) > left())
      return Fault(field, "impossible length of a string");
    const auto* begin = bytes_.data() + at_;
    const auto* zero = std::memchr(begin, 0, static_cast<size_t>(length));
    if (zero != begin + length - 1) return Fault(field, "a string without its end, or with an end inside");
    at_ += static_cast<size_t>(length);
    return true;
  }
  /// How many elements the field has; none when they cannot fit.
  std::optional<size_t> Elements(const Field& field, const std::vector<int64_t>& values) {
    size_t elements = 1;
    for (const Field::Dimension& dimension : field.dimensions) {
      const int64_t n =
          dimension.counted_by < 0 ? dimension.constant : values[static_cast<size_t>(dimension.counted_by)];
      if (n < 0) return Fault(field, "negative count"), std::nullopt;
      // Every element takes at least one byte, so no sound product can exceed what is left.
      if (n != 0 && elements > left() / static_cast<size_t>(n))
        return Fault(field, "too short"), std::nullopt;
      elements *= static_cast<size_t>(n);
    }
    return elements;
  }
  bool FieldOf(const Field& field, std::vector<int64_t>& values) {
    const std::optional<size_t> elements = Elements(field, values);
    if (!elements) return false;
    if (field.kind == Field::Kind::kInteger || field.kind == Field::Kind::kReal) {
      const auto size = static_cast<size_t>(field.size_bytes);
      if (*elements > left() / size) return Fault(field, "too short");
      const bool may_count = field.kind == Field::Kind::kInteger && field.dimensions.empty();
      values.push_back(may_count ? ReadInteger(field.size_bytes) : 0);
      at_ += *elements * size;
      return true;
    }
    values.push_back(0);
    for (size_t i = 0; i < *elements; ++i) {
      if (field.kind == Field::Kind::kString) {
        if (!String(field)) return false;
      } else if (!Struct(*schema_.Find(field.type))) {
        fault_ = field.name + "." + fault_;
        return false;
      }
    }
    return true;
  }
  bool Struct(const StructType& type) {
    std::vector<int64_t> values;  // of the fields so far
    values.reserve(type.fields.size());
    for (const Field& field : type.fields) {
      if (!FieldOf(field, values)) return false;
    }
    return true;
  }

  const Schema& schema_;
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
  std::string fault_;
};

}  // namespace

void Schema::Parse(std::string_view text) {
  Lexer lexer(text);
  lexer.Expect("package");
  lexer.Next();
  lexer.Expect(";");
  lexer.TakeComment();
  while (!lexer.Peek().empty()) {
    StructType type = ParseStruct(lexer);
    const std::string name = type.name;
    if (!types_.emplace(name, std::move(type)).second) Fail(name + " is defined twice");
  }
}

const StructType* Schema::Find(std::string_view name) const {
  const auto found = types_.find(name);
  return found == types_.end() ? nullptr : &found->second;
}

std::string Schema::FindFault(const StructType& type, std::span<const uint8_t> bytes) const {
  return Walker(*this, bytes).Run(type);
}

const Schema& Schema::OfProject() {
  static const Schema schema = [] {
    Schema all;
    for (const char* const* text = kLcmText; *text != nullptr; ++text) all.Parse(*text);
    for (const auto& [name, type] : all.types()) {
      for (const Field& field : type.fields) {
        const bool known = field.kind != Field::Kind::kStruct || all.Find(field.type) != nullptr;
        if (!known) Fail(name + "." + field.name + ": unknown type " + field.type);
      }
    }
    return all;
  }();
  return schema;
}

}  // namespace dmslam::wire
