#include "dmslam/messaging/lcm_bus.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <random>
#include <set>
#include <string_view>
#include <utility>

#include "dmslam/util/check.h"
#include "dmslam/util/not_yet_error.h"

namespace dmslam {
namespace {

constexpr int64_t kWantedReceiveBuffer = 4 << 20;
constexpr char kSelfChannel[] = "DMSLAM_SELF_";

bool IsUdp(const std::string& url) { return url.rfind("udpm://", 0) == 0; }
bool IsTcp(const std::string& url) { return url.rfind("tcpq://", 0) == 0; }

// Where the value of `key` stands in the URL's query: its offset and length.
std::optional<std::pair<size_t, size_t>> FindQueryValue(const std::string& url, const std::string& key) {
  for (size_t at = url.find('?'); at != std::string::npos; at = url.find('&', at + 1)) {
    if (url.compare(at + 1, key.size() + 1, key + "=") != 0) continue;
    const size_t begin = at + key.size() + 2;
    return std::pair(begin, std::min(url.find('&', begin), url.size()) - begin);
  }
  return std::nullopt;
}

std::optional<std::string> QueryValue(const std::string& url, const std::string& key) {
  const auto place = FindQueryValue(url, key);
  if (!place) return std::nullopt;
  return url.substr(place->first, place->second);
}

std::string WithQuery(std::string url, const std::string& key, const std::string& value) {
  if (const auto place = FindQueryValue(url, key)) return url.replace(place->first, place->second, value);
  return url + (url.find('?') == std::string::npos ? "?" : "&") + key + "=" + value;
}

std::string UrlWithBuffer(const std::string& url) {
  if (!IsUdp(url) || QueryValue(url, "recv_buf_size")) return url;
  return WithQuery(url, "recv_buf_size", std::to_string(kWantedReceiveBuffer));
}

std::string CureFor(const std::string& url) {
  if (IsUdp(url)) {
    const bool leaves_host = std::atoi(QueryValue(url, "ttl").value_or("0").c_str()) > 0;
    const std::string route =
        leaves_host ? "`ip route add 224.0.0.0/4 dev DEVICE`, with the device that leads to the other hosts,"
                    : "`ip link set lo up; ip route add 224.0.0.0/4 dev lo`";
    return "is there a multicast route? " + route +
           " makes one; the form is udpm://239.255.76.67:PORT?ttl=" + (leaves_host ? "1" : "0");
  }
  if (IsTcp(url)) return "is its server running? See docs/two-machines.md";
  return "known are udpm://GROUP:PORT?ttl=N, tcpq://HOST:PORT and memq://";
}

std::string NoteOnReceiveBuffer(const std::string& url) {
  if (!IsUdp(url)) return "";
  const int64_t wanted = std::atoll(QueryValue(url, "recv_buf_size").value_or("0").c_str());
  int64_t allowed = wanted;
  std::ifstream("/proc/sys/net/core/rmem_max") >> allowed;
  std::string note = "receive buffer " + std::to_string(std::min(wanted, allowed)) + " bytes";
  if (allowed < wanted) {
    note += " instead of " + std::to_string(wanted) +
            ": large messages are lost and repaired; `sysctl -w net.core.rmem_max=" + std::to_string(wanted) +
            "` cures it";
  }
  return note;
}

// LCM takes a channel to subscribe to for a regular expression.
std::string Literally(const std::string& name) {
  std::string pattern;
  for (const char c : name) {
    if (std::string_view(".\\+*?[]^$(){}|").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  return pattern;
}

}  // namespace

struct LcmBus::Impl {
  explicit Impl(const std::string& url) : lcm(url) {}
  static void OnMessage(const lcm::ReceiveBuffer* buffer, const std::string& channel, LcmBus* owner) {
    owner->Receive(channel, {static_cast<const uint8_t*>(buffer->data), buffer->data_size});
  }
  lcm::LCM lcm;
  std::unique_ptr<lcm::LCM> tap;  // with ttl 0, where the bus itself leaves the host
  std::set<std::string> subscribed;
};

LcmBus::LcmBus(Options options) : options_(std::move(options)) {
  options_.url = UrlWithBuffer(options_.url);
  impl_ = std::make_unique<Impl>(options_.url);
  const auto refuse = [this] {
    const std::string why = "LCM at " + options_.url + " cannot be used: " + CureFor(options_.url);
    if (IsUdp(options_.url) || IsTcp(options_.url)) throw NotYetError(why);
    throw InputError(why);
  };
  if (!impl_->lcm.good()) refuse();
  if (IsUdp(options_.url) && QueryValue(options_.url, "ttl").value_or("0") != "0") {
    impl_->tap = std::make_unique<lcm::LCM>(WithQuery(options_.url, "ttl", "0"));
    if (!impl_->tap->good()) refuse();
  }
  receive_buffer_note_ = NoteOnReceiveBuffer(options_.url);
}

LcmBus::~LcmBus() = default;

/// Twice to one channel LCM would deliver each message twice.
void LcmBus::Subscribe(const std::string& channel) {
  if (!impl_->subscribed.insert(channel).second) return;
  const std::string pattern = Literally(options_.prefix + channel);
  lcm::Subscription* subscription = impl_->lcm.subscribeFunction(pattern, &Impl::OnMessage, this);
  if (subscription == nullptr || impl_->lcm.getFileno() < 0) {
    throw NotYetError("LCM at " + options_.url + " does not receive: " + CureFor(options_.url));
  }
  subscription->setQueueCapacity(options_.queue_capacity);
}

void LcmBus::Publish(const Outgoing& message) {
  lcm::LCM& lcm = message.local && impl_->tap ? *impl_->tap : impl_->lcm;
  // The result says little (0 even when a fragment could not be sent): the protocol repairs what does not
  // arrive.
  lcm.publish(options_.prefix + message.channel, message.bytes->data(),
              static_cast<unsigned int>(message.bytes->size()));
}

int LcmBus::fd() const { return impl_->lcm.getFileno(); }

int LcmBus::Deliver(int max_messages) {
  int delivered = 0;
  for (; delivered < max_messages; ++delivered) {
    const int result = impl_->lcm.handleTimeout(0);
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (result == 0) break;
    if (result < 0) throw NotYetError("LCM at " + options_.url + " is lost: " + CureFor(options_.url));
  }
  return delivered;
}

bool LcmBus::IsDeaf(int64_t now_ns, int64_t longest_ns) {
  const bool silent = !std::exchange(hearing_.any, false);
  const bool for_long = std::exchange(hearing_.was_silent, silent) && silent;
  if (!silent) hearing_.unheard_ns.reset();
  if (for_long && SpeakToItself() && !hearing_.unheard_ns) hearing_.unheard_ns = now_ns;
  return hearing_.unheard_ns && now_ns - *hearing_.unheard_ns > longest_ns;
}

/// Whether that was sent: where there is no network it cannot be heard.
bool LcmBus::SpeakToItself() {
  if (hearing_.own_channel.empty()) {
    hearing_.own_channel = kSelfChannel + std::to_string(std::random_device()());
    Subscribe(hearing_.own_channel);
  }
  const uint8_t nothing = 0;
  return impl_->lcm.publish(options_.prefix + hearing_.own_channel, &nothing, sizeof(nothing)) == 0;
}

void LcmBus::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  hearing_.any = true;
  if (!handler_ || channel == options_.prefix + hearing_.own_channel) return;
  try {
    handler_(channel.substr(options_.prefix.size()), bytes);
  } catch (...) {  // must not unwind through LCM
    error_ = std::current_exception();
  }
}

}  // namespace dmslam
