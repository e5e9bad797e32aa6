#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/messaging/bus.h"

namespace dmslam {

/// The bus of processes: LCM. Its receiving thread only copies datagrams; handlers run in the thread that
/// calls Deliver.
class LcmBus : public Bus {
 public:
  struct Options {
    /// udpm://GROUP:PORT?ttl=N&recv_buf_size=BYTES, tcpq://HOST:PORT or memq://. Separate systems by port,
    /// not by group. 4 MB of receive buffer are asked for where the URL names none.
    std::string url = "udpm://239.255.76.67:7670?ttl=0";
    std::string prefix;          ///< of every channel: separates systems that must share a port
    int queue_capacity = 10000;  ///< messages per subscription; LCM's own 30 would lose records silently
  };

  /// Throws NotYetError that names the URL and the cure when LCM cannot be had: no multicast route, no
  /// server; InputError for a URL of another form.
  explicit LcmBus(Options options);
  ~LcmBus() override;

  void Subscribe(const std::string& channel) override;
  void SetHandler(Handler handler) override { handler_ = std::move(handler); }
  void Publish(const Outgoing& message) override;

  /// Readable when Deliver has something to do.
  int fd() const;
  /// Hands all that has arrived, up to `max_messages`, to the handler without waiting. What a handler throws
  /// comes out here, after LCM has returned. Throws NotYetError when the connection is gone (tcpq).
  int Deliver(int max_messages = 1000);

  /// Whether LCM's receiving thread has died or stands still: nothing at all was heard for longer than this,
  /// though this process has sent something to itself meanwhile. To be asked a few times within that; sends
  /// only where nobody else is heard.
  bool IsDeaf(int64_t now_ns, int64_t longest_ns);

  /// How large the receive buffer really is, and how to raise it if that is less than was asked for; empty
  /// without UDP.
  const std::string& receive_buffer_note() const { return receive_buffer_note_; }

 private:
  struct Impl;
  /// What is heard at all.
  struct Hearing {
    bool any = false;                   ///< since it was asked about
    bool was_silent = false;            ///< when it was asked about last
    std::string own_channel;            ///< on which this process speaks to itself; empty: not yet
    std::optional<int64_t> unheard_ns;  ///< since when it does, and nothing is heard
  };

  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  bool SpeakToItself();

  Options options_;
  Handler handler_;
  std::exception_ptr error_;
  Hearing hearing_;
  std::string receive_buffer_note_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dmslam
