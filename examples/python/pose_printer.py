#!/usr/bin/env python3
"""Prints where the camera is, frame by frame. Needs nothing of this project but the message types:

  lcm-gen -p --ppath=types lcmtypes/dmslam_pose_t.lcm
  PYTHONPATH=types:examples/python python3 examples/python/pose_printer.py 'udpm://239.255.76.67:7670?ttl=0'

The bus may also be a log, played as fast as possible: 'file://run.lcmlog?speed=0'. "examples/python" is left out of the path
where LCM's own bindings are installed.
"""
import sys

import lcm

from dmslam import pose_t

STATES = ["no map yet", "waiting for a map", "trying a map", "tracking", "uncertain", "lost",
          "placed later", "rotation only", "too few landmarks"]


def on_pose(channel, data):
    pose = pose_t.decode(data)
    stamp = f"{pose.stamp_ns // 1000000000}.{pose.stamp_ns % 1000000000:09}"
    state = STATES[pose.state] if pose.state < len(STATES) else "unknown state"
    if not pose.has_pose:
        print(f"{stamp} frame {pose.frame_index}: {state}", flush=True)
        return
    print(f"{stamp} frame {pose.frame_index}: at ({pose.x:.4f}, {pose.y:.4f}, {pose.z:.4f}) of map {pose.map_id}, {state} by "
          f"{pose.inliers} features, {100 * pose.moving_share:.0f} % of the image moves", flush=True)


def main():
    bus = lcm.LCM(sys.argv[1] if len(sys.argv) > 1 else "udpm://239.255.76.67:7670?ttl=0")
    bus.subscribe("DMSLAM_FRONTEND_POSE", on_pose)
    try:
        while True:
            bus.handle()
    except (IOError, KeyboardInterrupt):
        pass  # a log ends; a network does not


if __name__ == "__main__":
    main()
