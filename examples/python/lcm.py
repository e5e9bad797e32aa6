"""LCM for Python on the library that Debian ships (liblcm1), by ctypes: no compiler, nothing from PyPI.

The calls are those of LCM's own bindings ("pip install lcm"), as far as a program needs them to publish, listen and read
logs; with those installed this file is not needed. Handlers get (channel, bytes), as there.
"""
import ctypes
import select

_lib = ctypes.CDLL("liblcm.so.1")


class _ReceiveBuffer(ctypes.Structure):
    _fields_ = [("data", ctypes.c_void_p), ("data_size", ctypes.c_uint32), ("recv_utime", ctypes.c_int64),
                ("lcm", ctypes.c_void_p)]


_HANDLER = ctypes.CFUNCTYPE(None, ctypes.POINTER(_ReceiveBuffer), ctypes.c_char_p, ctypes.c_void_p)
_lib.lcm_create.restype = ctypes.c_void_p
_lib.lcm_create.argtypes = [ctypes.c_char_p]
_lib.lcm_destroy.argtypes = [ctypes.c_void_p]
_lib.lcm_subscribe.restype = ctypes.c_void_p
_lib.lcm_subscribe.argtypes = [ctypes.c_void_p, ctypes.c_char_p, _HANDLER, ctypes.c_void_p]
_lib.lcm_publish.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_uint]
for _name in ("lcm_handle", "lcm_get_fileno"):
    getattr(_lib, _name).argtypes = [ctypes.c_void_p]


class LCM:
    def __init__(self, url=""):
        self._lcm = _lib.lcm_create(url.encode())
        if not self._lcm:
            raise RuntimeError(f"{url}: this bus cannot be used")
        self._handlers = []  # the library keeps pointers to them
        self._error = None

    def __del__(self):
        if getattr(self, "_lcm", None):
            _lib.lcm_destroy(self._lcm)

    def publish(self, channel, data):
        if _lib.lcm_publish(self._lcm, channel.encode(), bytes(data), len(data)) != 0:
            raise IOError(f"{channel}: not sent")

    def subscribe(self, channel, handler):
        """channel: a name, or a regular expression of LCM's."""
        def on_message(buffer, name, _):
            try:
                handler(name.decode(), ctypes.string_at(buffer.contents.data, buffer.contents.data_size))
            except BaseException as error:  # must not leave the library's callback; handle() raises it
                self._error = error
        self._handlers.append(_HANDLER(on_message))
        _lib.lcm_subscribe(self._lcm, channel.encode(), self._handlers[-1], None)

    def fileno(self):
        return _lib.lcm_get_fileno(self._lcm)

    def handle(self):
        """Waits for one message. IOError where a log has ended."""
        status = _lib.lcm_handle(self._lcm)
        if self._error:
            error, self._error = self._error, None
            raise error
        if status != 0:
            raise IOError("the log has ended, or the bus is lost")

    def handle_timeout(self, milliseconds):
        """Waits so long for one message; returns whether one came."""
        if not select.select([self.fileno()], [], [], milliseconds / 1000)[0]:
            return False
        self.handle()
        return True
