#!/usr/bin/env python3
"""Images of a ROS camera to dmslam, its poses back to ROS. ROS 1 and ROS 2, whichever is there.

  lcm-gen -p --ppath=types lcmtypes/*.lcm
  PYTHONPATH=types:examples/python:$PYTHONPATH python3 examples/ros_bridge/ros_bridge.py IMAGE_TOPIC INFO_TOPIC [BUS]

IMAGE_TOPIC is a sensor_msgs/Image (mono8, rgb8 or bgr8), INFO_TOPIC its sensor_msgs/CameraInfo with distortion model
plumb_bob. Poses appear on /dmslam/pose (geometry_msgs/PoseStamped, frame dmslam_map): world from camera, in map units, the
camera's axes being x right, y down, z forward (ROS calls that an optical frame).
"""
import sys
import threading
import time
import zlib

import lcm

from dmslam import camera_info_t, end_of_sequence_t, frame_t, pose_t

from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import CameraInfo, Image

BUS = "udpm://239.255.76.67:7670?ttl=0&recv_buf_size=4194304"
ENCODINGS = {"mono8": (frame_t.ENCODING_GRAY8, 1), "rgb8": (frame_t.ENCODING_RGB8, 3), "bgr8": (frame_t.ENCODING_BGR8, 3)}


def sealed(message):
    """The encoded message with the CRC-32 of its own bytes, taken while the field is zero."""
    message.checksum = 0
    checksum = zlib.crc32(message.encode())
    message.checksum = checksum - (checksum >> 31 << 32)  # LCM's integers are signed
    return message.encode()


def stamp_ns(stamp):
    """Of a ROS 1 or ROS 2 time."""
    return stamp.to_nsec() if hasattr(stamp, "to_nsec") else stamp.sec * 1000000000 + stamp.nanosec


def camera_from_ros(info, session):
    fisheye = info.distortion_model in ("equidistant", "fisheye")
    if not fisheye and info.distortion_model not in ("plumb_bob", ""):
        raise ValueError(f"distortion model {info.distortion_model} is not supported; undistort the images first")
    k = list(getattr(info, "K", None) or getattr(info, "k"))
    d = list(getattr(info, "D", None) or getattr(info, "d", [])) + [0.0] * 5
    camera = camera_info_t()
    camera.session, camera.mode, camera.speed, camera.fps = session, camera_info_t.MODE_REALTIME, 1.0, 30.0
    camera.width_px, camera.height_px = info.width, info.height
    camera.fx_px, camera.cx_px, camera.fy_px, camera.cy_px = k[0], k[2], k[4], k[5]
    if fisheye:
        camera.lens = camera_info_t.LENS_FISHEYE
        camera.k1, camera.k2, camera.k3, camera.k4 = d[:4]
    else:
        camera.k1, camera.k2, camera.p1, camera.p2, camera.k3 = d[:5]
    camera.sequence = "ros"
    return camera


def frame_from_ros(image, session, index):
    if image.encoding not in ENCODINGS:
        raise ValueError(f"image encoding {image.encoding} is not supported; convert to one of {', '.join(ENCODINGS)}")
    encoding, channels = ENCODINGS[image.encoding]
    row = image.width * channels
    data = bytes(image.data)
    if image.step != row:  # rows are padded
        data = b"".join(data[y * image.step:y * image.step + row] for y in range(image.height))
    frame = frame_t()
    frame.session, frame.frame_index, frame.encoding = session, index, encoding
    frame.stamp_ns = stamp_ns(image.header.stamp)
    frame.utime = frame.stamp_ns // 1000
    frame.capture_us = frame.publish_us = time.time_ns() // 1000
    frame.width_px, frame.height_px = image.width, image.height
    frame.data, frame.num_bytes = data, len(data)
    return frame


class Bridge:
    """Between the bus and whoever gives it ROS messages; `send(PoseStamped)` and `make_time(ns)` are ROS's part."""

    def __init__(self, bus, send, make_time):
        self.lcm, self.send, self.make_time = lcm.LCM(bus), send, make_time
        self.session, self.index, self.camera = time.time_ns() // 1000000000 % 2000000000, 0, None
        self.lcm.subscribe("DMSLAM_FRONTEND_POSE", self.on_pose)
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        while True:
            self.lcm.handle_timeout(1000)

    def on_info(self, info):
        if self.camera is None:
            self.camera = camera_from_ros(info, self.session)

    def on_image(self, image):
        if self.camera is None:
            return  # its CameraInfo has not come yet
        if self.index % 10 == 0:
            self.lcm.publish("DMSLAM_PLAYER_CAMERA_INFO", sealed(self.camera))
        self.lcm.publish("DMSLAM_PLAYER_FRAME", sealed(frame_from_ros(image, self.session, self.index)))
        self.index += 1

    def on_pose(self, channel, data):
        pose = pose_t.decode(data)
        if pose.session != self.session or not pose.has_pose:
            return
        message = PoseStamped()
        message.header.frame_id = "dmslam_map"
        message.header.stamp = self.make_time(pose.stamp_ns)
        p, q = message.pose.position, message.pose.orientation
        p.x, p.y, p.z = pose.x, pose.y, pose.z
        q.x, q.y, q.z, q.w = pose.qx, pose.qy, pose.qz, pose.qw
        self.send(message)

    def close(self):
        """Tells that no more frames follow, so that results are written. ROS may be gone already."""
        self.send = lambda message: None
        end = end_of_sequence_t()
        end.session, end.frames_published, end.frames_listed = self.session, self.index, self.index
        end.last_frame_index = self.index - 1
        for _ in range(5):
            self.lcm.publish("DMSLAM_PLAYER_END_OF_SEQUENCE", sealed(end))
            time.sleep(0.2)


def main_ros1(rospy, image_topic, info_topic, bus):
    rospy.init_node("dmslam_bridge")
    poses = rospy.Publisher("/dmslam/pose", PoseStamped, queue_size=10)
    bridge = Bridge(bus, poses.publish, lambda ns: rospy.Time(ns // 1000000000, ns % 1000000000))
    rospy.Subscriber(info_topic, CameraInfo, bridge.on_info)
    rospy.Subscriber(image_topic, Image, bridge.on_image, queue_size=2, buff_size=1 << 24)
    rospy.on_shutdown(bridge.close)
    rospy.spin()


def main_ros2(rclpy, image_topic, info_topic, bus):
    from rclpy.executors import ExternalShutdownException
    from rclpy.qos import qos_profile_sensor_data
    from rclpy.time import Time
    rclpy.init()
    node = rclpy.create_node("dmslam_bridge")
    poses = node.create_publisher(PoseStamped, "/dmslam/pose", 10)
    bridge = Bridge(bus, poses.publish, lambda ns: Time(nanoseconds=ns).to_msg())
    node.create_subscription(CameraInfo, info_topic, bridge.on_info, qos_profile_sensor_data)
    node.create_subscription(Image, image_topic, bridge.on_image, qos_profile_sensor_data)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        bridge.close()
        rclpy.try_shutdown()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    arguments = (sys.argv + [BUS])[1:4]
    try:
        import rclpy
    except ImportError:
        import rospy
        main_ros1(rospy, *arguments)
    else:
        main_ros2(rclpy, *arguments)
