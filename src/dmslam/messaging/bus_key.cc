#include "dmslam/messaging/bus_key.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr std::array<uint8_t, 8> kMark = {0xD5, 'K', 'e', 'y', 'T', 'a', 'g', 0x01};
constexpr size_t kCounterAt = 4, kSenderAt = 12, kMacAt = 20;
// Of what the file holds one key is made for this purpose alone; another version of the tag gets another key.
constexpr char kPurpose[] = "dmslam bus tag 1";

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

/// systemd owns the files that it hands to a service, and lets only the service into their folder.
bool IsCredential(const std::string& path, const struct stat& status) {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  return folder != nullptr && *folder != '\0' && path.starts_with(std::string(folder) + "/") &&
         path.find("/../") == std::string::npos && status.st_uid == 0 && (status.st_mode & S_IRWXO) == 0;
}

std::string WhyUnsafe(const std::string& path, const struct stat& status) {
  if (!S_ISREG(status.st_mode)) return "is no file; check --key";
  if (IsCredential(path, status)) return "";
  if (status.st_uid != geteuid()) {
    return "belongs to another user (" + std::to_string(status.st_uid) + ", this process runs as " +
           std::to_string(geteuid()) + "); make a copy of your own, with mode 0600";
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO | S_IXUSR)) != 0)
    return "can be read by others than its owner; `chmod 600 " + path + "` cures it";
  return "";
}

std::string ReadAll(const std::string& path, int fd) {
  std::string text(BusKey::kMostBytes + 2, '\0');
  size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = read(fd, text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw InputError(path + ": cannot be read: " + std::strerror(errno) + "; check --key");
    if (got == 0) break;
    size += static_cast<size_t>(got);
  }
  text.resize(size);
  return text;
}

}  // namespace

bool HasTag(std::span<const uint8_t> message) {
  return message.size() >= kTagBytes && std::equal(kMark.begin(), kMark.end(), message.end() - kMark.size());
}

std::span<const uint8_t> WithoutTag(std::span<const uint8_t> message) {
  return HasTag(message) ? message.first(message.size() - kTagBytes) : message;
}

BusKey BusKey::Load(const std::string& path) {
  const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.fd < 0) throw InputError(path + ": cannot be read: " + std::strerror(errno) + "; check --key");
  struct stat status {};
  if (fstat(file.fd, &status) != 0) throw InputError(path + ": cannot be read; check --key");
  if (const std::string why = WhyUnsafe(path, status); !why.empty())
    throw InputError("the key " + path + " " + why);
  std::string text = ReadAll(path, file.fd);
  size_t size = text.size();
  while (size > 0 && (text[size - 1] == '\n' || text[size - 1] == '\r')) --size;
  if (size < kLeastBytes || size > kMostBytes) {
    throw InputError("the key " + path + " has " + std::to_string(size) + " bytes; wanted are " +
                     std::to_string(kLeastBytes) + " to " + std::to_string(kMostBytes) +
                     ": `(umask 077; head -c 32 /dev/urandom | base64 > " + path + ")` makes one");
  }
  BusKey key({reinterpret_cast<const uint8_t*>(text.data()), size});
  sodium_memzero(text.data(), text.size());
  return key;
}

std::optional<BusKey> BusKey::LoadIfWanted(const std::string& file) {
  if (!file.empty()) return Load(file);
  const char* named = std::getenv("DMSLAM_KEY_FILE");
  if (named == nullptr || *named == '\0') return std::nullopt;
  return Load(named);
}

BusKey::BusKey(std::span<const uint8_t> secret) {
  static_assert(sizeof(key_) == crypto_shorthash_siphashx24_KEYBYTES);
  static_assert(kMacBytes == crypto_shorthash_siphashx24_BYTES);
  DMSLAM_CHECK(sodium_init() >= 0, "libsodium must find what it needs of the system");
  DMSLAM_CHECK(secret.size() >= kLeastBytes, "a key must be long enough");
  crypto_generichash_state state;
  crypto_generichash_init(&state, reinterpret_cast<const uint8_t*>(kPurpose), sizeof(kPurpose), key_.size());
  crypto_generichash_update(&state, secret.data(), secret.size());
  crypto_generichash_final(&state, key_.data(), key_.size());
}

BusKey::~BusKey() { sodium_memzero(key_.data(), key_.size()); }

/// With a key for each channel: no tag fits on another one.
BusKey::Mac BusKey::Compute(std::string_view channel, std::span<const uint8_t> message_and_said) const {
  Mac channel_key{}, mac{};
  crypto_shorthash_siphashx24(channel_key.data(), reinterpret_cast<const uint8_t*>(channel.data()),
                              channel.size(), key_.data());
  crypto_shorthash_siphashx24(mac.data(), message_and_said.data(), message_and_said.size(),
                              channel_key.data());
  return mac;
}

Bytes BusKey::WithTag(std::string_view channel, std::span<const uint8_t> message, const Tag& tag) const {
  std::array<uint8_t, kMacAt> said{};
  PutInt(tag.session, 0, said);
  PutInt(tag.counter, kCounterAt, said);
  PutInt(tag.sender, kSenderAt, said);
  Bytes tagged;
  tagged.reserve(message.size() + kTagBytes);
  tagged.insert(tagged.end(), message.begin(), message.end());
  tagged.insert(tagged.end(), said.begin(), said.end());
  const Mac mac = Compute(channel, tagged);
  tagged.insert(tagged.end(), mac.begin(), mac.end());
  tagged.insert(tagged.end(), kMark.begin(), kMark.end());
  return tagged;
}

std::optional<Tag> BusKey::Verify(std::string_view channel, std::span<const uint8_t> tagged) const {
  if (!HasTag(tagged)) return std::nullopt;
  const std::span<const uint8_t> end = tagged.last(kTagBytes);
  const Mac mac = Compute(channel, tagged.first(tagged.size() - kTagBytes + kMacAt));
  if (sodium_memcmp(mac.data(), end.data() + kMacAt, mac.size()) != 0) return std::nullopt;
  return Tag{GetInt<uint32_t>(end, 0), GetInt<uint64_t>(end, kCounterAt), GetInt<uint64_t>(end, kSenderAt)};
}

}  // namespace dmslam
