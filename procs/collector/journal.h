#pragma once

#include <cstdio>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// Records on disk: what a run of any length needs only at its end takes no memory, and a collector that is
/// started again has what the one before it had accepted. A record that was not written whole is not there.
class Journal {
 public:
  explicit Journal(std::string path) : path_(std::move(path)) {}
  ~Journal() { Close(); }
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  using Handler = std::function<void(std::span<const uint8_t> record)>;

  /// Hands out the records of `session` that are there, in order, and goes on behind them.
  void Resume(int64_t session, const Handler& handle);
  /// Hands out all records, in order.
  void ForEach(const Handler& handle);
  /// Throws InputError where it cannot be written.
  void Append(std::span<const uint8_t> record);
  /// It is no longer needed.
  void Remove();

 private:
  void Open();
  bool ReadNext(std::vector<uint8_t>* record);
  void Close();

  std::string path_;
  std::FILE* file_ = nullptr;
};

}  // namespace dmslam
