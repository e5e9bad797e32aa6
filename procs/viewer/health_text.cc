#include "viewer/health_text.h"

#include <cstdio>
#include <functional>

#include "dmslam/messaging/roles.h"

namespace dmslam {
namespace {

using Process = ProcessBoard::Process;
using Life = ProcessBoard::Life;

bool IsNeeded(const Process& process) {
  const std::string& name = process.name;
  return process.needed || name == roles::kPlayer || name == roles::kFrontend || name == roles::kMapper;
}

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.10g", value);
  return text;
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) >= 0x20) quoted += c;
  }
  return quoted += "\"";
}

/// Families of measurements, each with its samples.
class Page {
 public:
  void Family(const char* name, const char* type, const char* help) {
    name_ = name;
    text_.append("# HELP dmslam_").append(name).append(" ").append(help).append("\n");
    text_.append("# TYPE dmslam_").append(name).append(" ").append(type).append("\n");
  }
  void Sample(const std::string& label, const std::string& value, double number) {
    text_.append("dmslam_").append(name_);
    if (!label.empty()) text_.append("{").append(label).append("=").append(Quoted(value)).append("}");
    text_.append(" ").append(Number(number)).append("\n");
  }
  void One(const char* name, const char* type, const char* help, double number) {
    Family(name, type, help);
    Sample("", "", number);
  }
  std::string Take() { return std::move(text_); }

 private:
  std::string name_, text_;
};

struct Column {
  const char* name;
  const char* type;
  const char* help;
  std::function<double(const Process&)> value;
  bool told = true;  ///< known of those only who say how they fare
};

template <typename Field>
std::function<double(const Process&)> Of(Field ProcessHealth::*field) {
  return [field](const Process& process) { return static_cast<double>(process.health.*field); };
}

const std::vector<Column>& Columns() {
  static const std::vector<Column> columns = {
      {"up", "gauge", "1 where the process is heard, 0 where it is silent",
       [](const Process& p) { return p.life == Life::kUp || p.life == Life::kBack ? 1.0 : 0.0; }, false},
      {"restarts_total", "counter", "other processes heard under this name",
       [](const Process& p) { return static_cast<double>(p.restarts); }, false},
      {"resident_megabytes", "gauge", "resident memory", Of(&ProcessHealth::rss_mb)},
      {"cpu_percent", "gauge", "processor time of one core, over the last second",
       Of(&ProcessHealth::cpu_percent)},
      {"queue_depth", "gauge", "messages received and not yet worked on", Of(&ProcessHealth::queue_depth)},
      {"unacknowledged_records", "gauge", "records that some reader still lacks",
       Of(&ProcessHealth::unacknowledged)},
      {"records_lost_total", "counter", "records given up, bridged by a snapshot",
       Of(&ProcessHealth::records_lost)},
      {"records_repaired_total", "counter", "records that arrived only because they were asked for again",
       Of(&ProcessHealth::records_repaired)},
      {"dropped_malformed_total", "counter", "messages with wrong length, counts or values",
       Of(&ProcessHealth::dropped_malformed)},
      {"dropped_checksum_total", "counter", "messages with a wrong checksum",
       Of(&ProcessHealth::dropped_checksum)},
      {"dropped_foreign_total", "counter", "messages of other sessions", Of(&ProcessHealth::dropped_foreign)},
      {"dropped_without_room_total", "counter", "messages for which the queue had no room",
       Of(&ProcessHealth::dropped_overflow)},
      {"refused_peers_total", "counter", "beacons of another protocol or schema",
       Of(&ProcessHealth::refused_peers)},
      {"recovery_p99_milliseconds", "gauge", "from a record's being named as missing to its being here",
       Of(&ProcessHealth::recovery_p99_ms)}};
  return columns;
}

std::string Prometheus(const ProcessBoard& board, const FrontendStatus& f, const MapperStatus& m) {
  Page page;
  for (const Column& column : Columns()) {
    page.Family(column.name, column.type, column.help);
    for (const Process& process : board.processes()) {
      const bool known = process.life != Life::kAwaited && (process.tells || !column.told);
      if (known) page.Sample("process", process.name, column.value(process));
    }
  }
  page.One("frames_per_second", "gauge", "frames processed over the last second", f.fps);
  page.One("frames_processed_total", "counter", "frames worked on", static_cast<double>(f.frames_processed));
  page.One("frames_skipped_total", "counter", "left out in favour of the newest: too many waited",
           static_cast<double>(f.frames_skipped));
  page.One("tracking", "gauge", "1 while the camera's pose is known",
           f.state == TrackingState::kTracking ? 1.0 : 0.0);
  page.One("inliers", "gauge", "static features in the newest frame", f.inliers);
  page.One("map_resets_total", "counter", "maps that were left", static_cast<double>(f.resets));
  page.Family("pose_latency_milliseconds", "gauge", "image published to pose published, over 10 s");
  page.Sample("quantile", "0.5", f.latency_p50_ms);
  page.Sample("quantile", "0.95", f.latency_p95_ms);
  page.Sample("quantile", "0.99", f.latency_p99_ms);
  page.One("map_keyframes", "gauge", "keyframes of all maps", m.keyframes);
  page.One("map_landmarks", "gauge", "landmarks of all maps", m.landmarks);
  page.One("keyframe_queue", "gauge", "keyframes that wait for the mapper", m.keyframe_queue);
  return page.Take();
}

}  // namespace

HealthText WriteHealth(const ProcessBoard& board, const FrontendStatus& frontend,
                       const MapperStatus& mapper) {
  HealthText health;
  health.well = true;
  std::string processes;
  for (const Process& process : board.processes()) {
    const bool absent = process.life == Life::kDown || (process.life == Life::kAwaited && IsNeeded(process));
    if (absent) health.well = false;
    processes += processes.empty() ? "" : ", ";
    processes += Quoted(process.name) + ": " + Quoted(ProcessBoard::Word(process.life));
  }
  health.json = std::string("{\"well\": ") + (health.well ? "true" : "false") + ", \"processes\": {" +
                processes + "}}\n";
  health.prometheus = Prometheus(board, frontend, mapper);
  return health;
}

}  // namespace dmslam
