#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dmslam::wire {

/// The text of lcmtypes/*.lcm, ended by a null pointer.
extern const char* const kLcmText[];

/// One field of a message type.
struct Field {
  enum class Kind : uint8_t { kInteger, kReal, kString, kStruct };
  /// A dimension of an array: a constant, or the integer field that counts.
  struct Dimension {
    int64_t constant = 0;
    int counted_by = -1;  ///< index of a field of the same struct; -1: constant
  };
  Kind kind = Kind::kInteger;
  std::string type;
  std::string name;
  std::string comment;
  int size_bytes = 0;  ///< of one element; 0 for strings and structs
  std::vector<Dimension> dimensions;
};

struct Constant {
  std::string type;
  std::string name;
  std::string value;
  std::string comment;
};

struct StructType {
  std::string name;
  std::string comment;
  std::vector<Field> fields;
  std::vector<Constant> constants;
};

/// Message types as their .lcm files define them.
class Schema {
 public:
  /// Adds the structs of one definition. Throws InvariantError that names what it does not understand.
  void Parse(std::string_view text);
  const StructType* Find(std::string_view name) const;
  const std::map<std::string, StructType, std::less<>>& types() const { return types_; }
  /// Walks over the encoded fields of a struct (without a fingerprint): every count is neither negative nor
  /// larger than what is left, every string is ended by its only zero, and nothing is left over. Never reads
  /// outside of `bytes`. Returns what is wrong, or nothing.
  std::string FindFault(const StructType& type, std::span<const uint8_t> bytes) const;

  /// All types of this project.
  static const Schema& OfProject();

 private:
  std::map<std::string, StructType, std::less<>> types_;
};

}  // namespace dmslam::wire
