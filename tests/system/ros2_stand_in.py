"""Runs a ROS 2 program where there is no ROS 2: modules of the same names that demand what rclpy's demand.

  python3 ros2_stand_in.py LOG POSES FPS PROGRAM ARGUMENTS...

Messages have ROS 2's fields and no others, and take only values of their exact types; arrays are array.array and something
that, like numpy's, has no truth value. spin() is the camera: it gives the frames of LOG (camera channels, frames as raw grey
values) to whoever subscribed, FPS a second with their own stamps, waits until no more poses come, and ends as Ctrl-C ends the
real one. What is published is written to POSES, a line per message, stamped.
"""
import array
import runpy
import sys
import threading
import time
import types


class Field:
    """A field of a message: assignments of another type are refused, as rosidl's generated classes refuse them."""

    def __init__(self, kind, low=None, high=None):
        self.kind, self.low, self.high = kind, low, high

    def __set_name__(self, owner, name):
        self.name = "_" + name

    def __get__(self, message, owner):
        return getattr(message, self.name)

    def __set__(self, message, value):
        assert isinstance(value, self.kind), f"{self.name[1:]} must be of type {self.kind.__name__}, not {type(value).__name__}"
        assert self.low is None or self.low <= value <= self.high, f"{self.name[1:]} must lie in [{self.low}, {self.high}]"
        object.__setattr__(message, self.name, value)


class Message:
    """Like the generated ones it has no fields but its own."""

    def __init__(self, **values):
        for name, field in vars(type(self)).items():
            if isinstance(field, Field):
                setattr(self, name, values.get(name, field.kind()))

    def __setattr__(self, name, value):
        assert isinstance(vars(type(self)).get(name), Field), f"{type(self).__name__} has no field {name}"
        object.__setattr__(self, name, value)


class Numbers(list):
    """A fixed array: numpy's have no truth value either."""

    def __bool__(self):
        raise ValueError("The truth value of an array with more than one element is ambiguous")


class Bytes(array.array):
    def __new__(cls, values=()):
        return super().__new__(cls, "B", values)


class Doubles(array.array):
    def __new__(cls, values=()):
        return super().__new__(cls, "d", values)


class Time(Message):
    sec, nanosec = Field(int, -2**31, 2**31 - 1), Field(int, 0, 2**32 - 1)


class Header(Message):
    stamp, frame_id = Field(Time), Field(str)


class Point(Message):
    x, y, z = Field(float), Field(float), Field(float)


class Quaternion(Message):
    x, y, z, w = Field(float), Field(float), Field(float), Field(float)


class Pose(Message):
    position, orientation = Field(Point), Field(Quaternion)


class PoseStamped(Message):
    header, pose = Field(Header), Field(Pose)


class CameraInfo(Message):
    header, height, width = Field(Header), Field(int, 0, 2**32 - 1), Field(int, 0, 2**32 - 1)
    distortion_model, d, k = Field(str), Field(Doubles), Field(Numbers)


class Image(Message):
    header, height, width = Field(Header), Field(int, 0, 2**32 - 1), Field(int, 0, 2**32 - 1)
    encoding, is_bigendian, step, data = Field(str), Field(int, 0, 255), Field(int, 0, 2**32 - 1), Field(Bytes)


class QoSProfile:
    pass


SENSOR_DATA = QoSProfile()


class ClockTime:
    def __init__(self, *, seconds=0, nanoseconds=0):
        self.nanoseconds = int(seconds * 1000000000) + nanoseconds

    def to_msg(self):
        return Time(sec=self.nanoseconds // 1000000000, nanosec=self.nanoseconds % 1000000000)


def stamp(ns):
    return Header(stamp=ClockTime(nanoseconds=ns).to_msg(), frame_id="camera")


class Publisher:
    def __init__(self, kind, node):
        self.kind, self.node = kind, node

    def publish(self, message):
        assert node_is_up(self.node), "publish() after the context was shut down"
        assert type(message) is self.kind, f"Expected {self.kind}, got {type(message)}"
        at, pose = message.header.stamp, message.pose
        with self.node.lock:
            self.node.last = time.monotonic()
            p, q = pose.position, pose.orientation
            print(f"{at.sec}.{at.nanosec:09} {p.x} {p.y} {p.z} {q.x} {q.y} {q.z} {q.w} {message.header.frame_id}",
                  file=self.node.poses, flush=True)


def node_is_up(node):
    return node is not None and not node.down


class Node:
    def __init__(self, name, log, poses, fps):
        assert isinstance(name, str)
        self.log, self.poses, self.fps = log, open(poses, "w", encoding="utf-8"), fps
        self.callbacks, self.lock, self.last, self.down = {}, threading.Lock(), 0.0, False

    @staticmethod
    def quality(profile):
        assert isinstance(profile, (int, QoSProfile)), "Expected QoSProfile or int"

    def create_publisher(self, kind, topic, qos_profile):
        assert issubclass(kind, Message) and topic.startswith("/")
        self.quality(qos_profile)
        return Publisher(kind, self)

    def create_subscription(self, kind, topic, callback, qos_profile):
        assert issubclass(kind, Message) and callable(callback)
        self.quality(qos_profile)
        self.callbacks[kind] = callback

    def give(self, kind, message):
        self.callbacks[kind](message)

    def spin(self):
        import lcm
        from dmslam import camera_info_t, frame_t
        log = lcm.LCM(f"file://{self.log}?speed=0")
        due = [time.monotonic() + 1.0]

        def on_camera(_, data):
            camera = camera_info_t.decode(data)
            k = Numbers([camera.fx_px, 0.0, camera.cx_px, 0.0, camera.fy_px, camera.cy_px, 0.0, 0.0, 1.0])
            d = Doubles([camera.k1, camera.k2, camera.p1, camera.p2, camera.k3])
            self.give(CameraInfo, CameraInfo(header=stamp(0), height=camera.height_px, width=camera.width_px,
                                             distortion_model="plumb_bob", d=d, k=k))

        def on_frame(_, data):
            frame = frame_t.decode(data)
            due[0] += 1.0 / self.fps
            time.sleep(max(0.0, due[0] - time.monotonic()))
            row, padding = frame.width_px, 32
            pixels = b"".join(frame.data[y * row:(y + 1) * row] + b"\0" * padding for y in range(frame.height_px))
            self.give(Image, Image(header=stamp(frame.stamp_ns), height=frame.height_px, width=row, encoding="mono8",
                                   step=row + padding, data=Bytes(pixels)))
        log.subscribe("DMSLAM_PLAYER_CAMERA_INFO", on_camera)
        log.subscribe("DMSLAM_PLAYER_FRAME", on_frame)
        try:
            while True:
                log.handle()
        except IOError:
            pass  # the log has ended
        self.last = time.monotonic()
        while time.monotonic() - self.last < 3.0:
            time.sleep(0.1)
        raise KeyboardInterrupt


def install(log, poses, fps):
    node = []

    def create_node(name):
        node.append(Node(name, log, poses, fps))
        return node[0]

    def shut_down():
        node[0].down = True

    rclpy = types.ModuleType("rclpy")
    rclpy.init, rclpy.create_node, rclpy.spin, rclpy.try_shutdown = lambda: None, create_node, Node.spin, shut_down
    modules = {
        "rclpy": rclpy,
        "rclpy.executors": {"ExternalShutdownException": type("ExternalShutdownException", (Exception,), {})},
        "rclpy.qos": {"qos_profile_sensor_data": SENSOR_DATA, "QoSProfile": QoSProfile},
        "rclpy.time": {"Time": ClockTime},
        "geometry_msgs": {}, "geometry_msgs.msg": {"PoseStamped": PoseStamped},
        "sensor_msgs": {}, "sensor_msgs.msg": {"CameraInfo": CameraInfo, "Image": Image},
    }
    for name, content in modules.items():
        if isinstance(content, dict):
            module = types.ModuleType(name)
            vars(module).update(content)
            content = module
        sys.modules[name] = content


if __name__ == "__main__":
    log_file, poses_file, rate, program = sys.argv[1:5]
    install(log_file, poses_file, float(rate))
    sys.argv = sys.argv[4:]
    runpy.run_path(program, run_name="__main__")
