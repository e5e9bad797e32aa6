#pragma once

#include <bit>
#include <concepts>
#include <functional>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "dmslam/util/check.h"
#include "dmslam/wire/check.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/schema.h"

// How messages are written and read. A message is described once, for both directions:
//
//   template <> struct Codec<FrameDone> {
//     using Wire = frame_done_t;
//     static constexpr const char* kChannel = channels::kFrameDone;
//     static void Fields(auto& s, auto& m, auto& w) { s(m.session, w.session); ... }
//     static void Validate(const FrameDone& m, Checker& check) { ... }
//   };
//
// `s` is a Put (message m to wire w) or a Get (wire to message).
namespace dmslam::wire {

template <typename Message>
struct Codec;

/// What an enumeration may hold; specialised for each that travels.
template <typename Enum>
struct EnumRange;

/// Eight bytes of a descriptor word in the order they travel: lowest bits first.
inline void PutWord(uint64_t word, uint8_t* bytes) {
  for (int i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(word >> (8 * i));
}
inline uint64_t GetWord(const uint8_t* bytes) {
  uint64_t word = 0;
  for (int i = 7; i >= 0; --i) word = (word << 8) | bytes[i];
  return word;
}

/// Microseconds, LCM's convention, of a stamp.
inline int64_t UtimeOf(int64_t stamp_ns) { return stamp_ns / 1000 - (stamp_ns % 1000 < 0 ? 1 : 0); }

/// Copies fields of a message to the wire.
class Put {
 public:
  static constexpr bool kToWire = true;
  explicit Put(Checker& check) : check_(check) {}
  Checker& check() { return check_; }

  // Integers of the same size keep their bits; into a larger one they keep their value.
  template <std::integral Value, std::integral WireValue>
  void operator()(const Value& value, WireValue& wire) {
    static_assert(sizeof(WireValue) >= sizeof(Value));
    wire = static_cast<WireValue>(value);
  }
  template <std::floating_point Value>
  void operator()(const Value& value, Value& wire) {
    wire = value;
  }
  template <typename Enum, std::integral WireValue>
  requires std::is_enum_v<Enum>
  void operator()(const Enum& value, WireValue& wire) {
    const int number = static_cast<int>(value);
    check_.Require(number >= static_cast<int>(EnumRange<Enum>::kFirst) &&
                       number <= static_cast<int>(EnumRange<Enum>::kLast),
                   EnumRange<Enum>::kName);
    wire = static_cast<WireValue>(number);
  }
  void operator()(const KeyframeId& id, int64_t& wire) { wire = static_cast<int64_t>(id.value); }
  void operator()(const LandmarkId& id, int64_t& wire) { wire = static_cast<int64_t>(id.value); }
  /// Ids and numbers that count from 1: absent is zero.
  template <typename Value, std::integral WireValue>
  void operator()(const std::optional<Value>& value, WireValue& wire) {
    wire = 0;
    if (!value) return;
    (*this)(*value, wire);
    check_.Require(wire != 0, "an id that is zero");
  }
  /// Stamps, indices and durations: absent is -1.
  template <typename Value, typename WireValue>
  requires std::is_arithmetic_v<WireValue>
  void OrMinusOne(const std::optional<Value>& value, WireValue& wire) {
    wire = -1;
    if (!value) return;
    (*this)(*value, wire);
    check_.Require(wire != -1, "a number that is -1");
  }
  void operator()(const std::string& text, std::string& wire) { wire = CleanText(text); }
  void operator()(const Rigid3d& T, double (&rotation)[4], double (&translation)[3]) {
    for (int i = 0; i < 4; ++i) rotation[i] = T.rotation.coeffs()[i];
    for (int i = 0; i < 3; ++i) translation[i] = T.translation[i];
  }
  void Utime(std::optional<int64_t> stamp_ns, int64_t& wire) { wire = UtimeOf(stamp_ns.value_or(0)); }

  template <typename Item, typename Memory>
  void Count(const std::vector<Item, Memory>& items, int32_t& wire,
             size_t most = std::numeric_limits<int32_t>::max()) {
    check_.Require(items.size() <= most, "a list is longer than may travel");
    wire = static_cast<int32_t>(items.size());
  }
  /// One value of each item as an array; `part(item)` names the value.
  template <typename Item, typename Memory, typename WireValue, typename Part>
  void Column(const std::vector<Item, Memory>& items, std::vector<WireValue>& wire, Part part) {
    wire.resize(items.size());
    for (size_t i = 0; i < items.size(); ++i) (*this)(std::invoke(part, items[i]), wire[i]);
  }
  /// The same for stamps whose absence is told as zero: a stamp of zero travels as an absent one.
  template <typename Item, typename Memory, typename Part>
  void StampColumn(const std::vector<Item, Memory>& items, std::vector<int64_t>& wire, Part part) {
    wire.resize(items.size());
    for (size_t i = 0; i < items.size(); ++i) wire[i] = std::invoke(part, items[i]).value_or(0);
  }
  void Bytes(const std::vector<uint8_t>& bytes, std::vector<uint8_t>& wire) { wire = bytes; }
  template <typename Item, typename Memory, typename Part>
  void Descriptors(const std::vector<Item, Memory>& items, int32_t& num_bytes, std::vector<uint8_t>& wire,
                   Part part) {
    wire.resize(32 * items.size());
    num_bytes = static_cast<int32_t>(wire.size());
    for (size_t i = 0; i < items.size(); ++i) {
      const Descriptor& descriptor = std::invoke(part, items[i]);
      for (size_t k = 0; k < 4; ++k) PutWord(descriptor.words[k], wire.data() + 32 * i + 8 * k);
    }
  }

 private:
  Checker& check_;
};

/// Copies fields from the wire to a message. The layout has been checked: arrays are as long as their counts.
class Get {
 public:
  static constexpr bool kToWire = false;
  explicit Get(Checker& check) : check_(check) {}
  Checker& check() { return check_; }

  template <std::integral Value, std::integral WireValue>
  void operator()(Value& value, const WireValue& wire) {
    static_assert(sizeof(WireValue) >= sizeof(Value));
    if constexpr (std::is_same_v<Value, bool>) {
      check_.Require(wire == 0 || wire == 1, "a truth value that is neither 0 nor 1");
    } else if constexpr (sizeof(WireValue) > sizeof(Value)) {
      check_.Require(std::in_range<Value>(wire), "a number out of range");
    }
    value = static_cast<Value>(wire);
  }
  template <std::floating_point Value>
  void operator()(Value& value, const Value& wire) {
    value = wire;
  }
  template <typename Enum, std::integral WireValue>
  requires std::is_enum_v<Enum>
  void operator()(Enum& value, const WireValue& wire) {
    const bool known = std::cmp_greater_equal(wire, static_cast<int>(EnumRange<Enum>::kFirst)) &&
                       std::cmp_less_equal(wire, static_cast<int>(EnumRange<Enum>::kLast));
    check_.Require(known, EnumRange<Enum>::kName);
    if (known) value = static_cast<Enum>(wire);
  }
  void operator()(KeyframeId& id, const int64_t& wire) { id.value = static_cast<uint64_t>(wire); }
  void operator()(LandmarkId& id, const int64_t& wire) { id.value = static_cast<uint64_t>(wire); }
  template <typename Value, std::integral WireValue>
  void operator()(std::optional<Value>& value, const WireValue& wire) {
    value.reset();
    if (wire != 0) (*this)(value.emplace(), wire);
  }
  template <typename Value, typename WireValue>
  requires std::is_arithmetic_v<WireValue>
  void OrMinusOne(std::optional<Value>& value, const WireValue& wire) {
    value.reset();
    if (wire != -1) (*this)(value.emplace(), wire);
  }
  void operator()(std::string& text, const std::string& wire) {
    check_.Require(IsCleanText(wire), "text that is too long or not clean");
    text = wire;
  }
  void operator()(Rigid3d& T, const double (&rotation)[4], const double (&translation)[3]) {
    for (int i = 0; i < 4; ++i) T.rotation.coeffs()[i] = rotation[i];
    for (int i = 0; i < 3; ++i) T.translation[i] = translation[i];
  }
  void Utime(std::optional<int64_t>, const int64_t&) {}

  template <typename Item, typename Memory>
  void Count(std::vector<Item, Memory>& items, const int32_t& wire,
             size_t most = std::numeric_limits<int32_t>::max()) {
    const bool sound = wire >= 0 && std::cmp_less_equal(wire, most);
    check_.Require(sound, "a list is longer than may travel");
    items.resize(sound ? static_cast<size_t>(wire) : 0);
  }
  template <typename Item, typename Memory, typename WireValue, typename Part>
  void Column(std::vector<Item, Memory>& items, const std::vector<WireValue>& wire, Part part) {
    for (size_t i = 0; i < std::min(items.size(), wire.size()); ++i)
      (*this)(std::invoke(part, items[i]), wire[i]);
  }
  template <typename Item, typename Memory, typename Part>
  void StampColumn(std::vector<Item, Memory>& items, const std::vector<int64_t>& wire, Part part) {
    Column(items, wire, part);
  }
  void Bytes(std::vector<uint8_t>& bytes, const std::vector<uint8_t>& wire) { bytes = wire; }
  template <typename Item, typename Memory, typename Part>
  void Descriptors(std::vector<Item, Memory>& items, const int32_t&, const std::vector<uint8_t>& wire,
                   Part part) {
    const bool sound = wire.size() == 32 * items.size();
    check_.Require(sound, "not 32 bytes per descriptor");
    for (size_t i = 0; sound && i < items.size(); ++i) {
      Descriptor& descriptor = std::invoke(part, items[i]);
      for (size_t k = 0; k < 4; ++k) descriptor.words[k] = GetWord(wire.data() + 32 * i + 8 * k);
    }
  }

 private:
  Checker& check_;
};

/// Coordinates of a vector, for Column.
template <int kIndex, auto kMember>
struct Coordinate {
  auto& operator()(auto& item) const { return (item.*kMember)[kIndex]; }
};

template <typename Message>
MessageInfo Info() {
  using Wire = typename Codec<Message>::Wire;
  constexpr bool kIsRecord = requires(Wire wire) { wire.header.seq; };
  return {Codec<Message>::kChannel, Wire::getTypeName(), kIsRecord, Wire::getHash()};
}

/// Where a record stands in its group.
void GroupFields(auto& s, auto& group, auto& w) {
  s(group.id, w.group_id);
  s(group.index, w.group_index);
  s(group.count, w.group_count);
}

/// Messages outside the streams carry a checksum of their own behind `utime`; a record's is in its header.
template <typename Wire>
concept HasChecksum = requires(Wire wire) {
  wire.checksum;
};
/// CRC-32, which every language's own library has, of a whole encoded message, its own four bytes taken as
/// zero.
uint32_t ChecksumOf(std::span<const uint8_t> bytes);
void PutChecksum(std::span<uint8_t> bytes);
bool ChecksumFits(std::span<const uint8_t> bytes);

template <typename Message>
std::vector<uint8_t> Encode(const Message& message) {
  using Wire = typename Codec<Message>::Wire;
  Checker check;
  Codec<Message>::Validate(message, check);
  Wire wire{};
  Put put(check);
  if (check.ok()) Codec<Message>::Fields(put, message, wire);
  if (!check.ok())
    throw InvariantError(std::string(Wire::getTypeName()) + " cannot be encoded: " + check.text());
  std::vector<uint8_t> bytes(static_cast<size_t>(wire.getEncodedSize()));
  const int size = static_cast<int>(bytes.size());
  DMSLAM_CHECK(wire.encode(bytes.data(), 0, size) == size, "a message must fill the size it announces");
  if constexpr (HasChecksum<Wire>) PutChecksum(bytes);
  return bytes;
}

/// What to say of bytes with the fingerprint of another type.
std::string OtherTypeFault(int64_t fingerprint);

/// What is wrong with the layout of some bytes that should be a `Wire`; empty: nothing.
template <typename Wire>
std::string LayoutFault(std::span<const uint8_t> bytes) {
  if (bytes.size() < 8) return "shorter than a fingerprint";
  if (bytes.size() > kMaxMessageBytes) return "longer than any message";
  uint64_t fingerprint = 0;
  for (size_t i = 0; i < 8; ++i) fingerprint = (fingerprint << 8) | bytes[i];
  if (fingerprint != static_cast<uint64_t>(Wire::getHash()))
    return OtherTypeFault(static_cast<int64_t>(fingerprint));
  const Schema& schema = Schema::OfProject();
  return schema.FindFault(*schema.Find(Wire::getTypeName()), bytes.subspan(8));
}

template <typename Message>
std::optional<Message> Decode(std::span<const uint8_t> bytes, std::string* reason) {
  using Wire = typename Codec<Message>::Wire;
  const auto refuse = [&](const std::string& why) {
    if (reason != nullptr) *reason = std::string(Wire::getTypeName()) + ": " + why;
    return std::nullopt;
  };
  const std::string fault = LayoutFault<Wire>(bytes);
  if (!fault.empty()) return refuse(fault);
  if constexpr (HasChecksum<Wire>) {
    if (!ChecksumFits(bytes)) return refuse("its checksum does not fit");
  }
  Wire wire{};
  const int size = static_cast<int>(bytes.size());
  if (wire.decode(bytes.data(), 0, size) != size)
    return refuse("the decoder did not consume exactly the bytes received");
  Checker check;
  Get get(check);
  std::optional<Message> message(std::in_place);
  Codec<Message>::Fields(get, *message, wire);
  if (check.ok()) Codec<Message>::Validate(*message, check);
  if (!check.ok()) return refuse(check.text());
  return message;
}

#define DMSLAM_WIRE_MESSAGE(Message)                             \
  template MessageInfo Info<Message>();                          \
  template std::vector<uint8_t> Encode<Message>(const Message&); \
  template std::optional<Message> Decode<Message>(std::span<const uint8_t>, std::string*)

}  // namespace dmslam::wire
