#pragma once

namespace dmslam {

/// What a process is to the others, as it stands in messages, on the command line and in the names of
/// programs. Where there are several cameras, each has a player and a frontend (OfCamera).
namespace roles {
inline constexpr char kPlayer[] = "player";
inline constexpr char kFrontend[] = "frontend";
inline constexpr char kMapper[] = "mapper";
inline constexpr char kLoopCloser[] = "loopcloser";
inline constexpr char kCollector[] = "collector";
inline constexpr char kViewer[] = "viewer";
}  // namespace roles

/// The same in upper case: names a process's stream, and stands in the names of its channels.
namespace owners {
inline constexpr char kPlayer[] = "PLAYER";
inline constexpr char kFrontend[] = "FRONTEND";
inline constexpr char kMapper[] = "MAPPER";
inline constexpr char kLoopCloser[] = "LOOPCLOSER";
inline constexpr char kCollector[] = "COLLECTOR";
}  // namespace owners

}  // namespace dmslam
