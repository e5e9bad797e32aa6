"""A headless Chromium, driven over its DevTools protocol. Needs Debian's chromium and python3-websocket."""

import base64
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time

import websocket


class PageError(Exception):
    """What a page threw."""


class Browser:
    """One page in one browser; everything it says on its console is kept."""

    ARGUMENTS = [
        "--headless=new", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-sync",
        "--disable-extensions", "--disable-component-update", "--disable-dev-shm-usage", "--hide-scrollbars",
        "--disable-gpu", "--enable-unsafe-swiftshader", "--mute-audio",
        "--disable-features=Translate,MediaRouter,OptimizationHints", "--no-proxy-server",
        "--remote-debugging-port=0", "--remote-allow-origins=*",
    ]

    def __init__(self, width=1440, height=900, scale=1):
        self._profile = tempfile.mkdtemp(prefix="dmslam-browser-")
        self._log = open(os.path.join(self._profile, "chromium.log"), "w", encoding="utf-8")
        self._process = subprocess.Popen(
            ["chromium", *self.ARGUMENTS, f"--user-data-dir={self._profile}", f"--window-size={width},{height}",
             f"--force-device-scale-factor={scale}", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=self._log, stderr=self._log, start_new_session=True)
        self._next_id = 0
        self.console = []  # (level, text)
        self._socket = websocket.create_connection(self._page_address(), timeout=60, max_size=None)
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False)

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()

    def close(self):
        try:
            self._socket.close()
        finally:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._log.close()
            shutil.rmtree(self._profile, ignore_errors=True)

    def _page_address(self):
        import urllib.request
        port_file = os.path.join(self._profile, "DevToolsActivePort")
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if self._process.poll() is not None:
                break
            if os.path.exists(port_file):
                lines = open(port_file, encoding="ascii").read().split()
                if lines:
                    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
                    with opener.open(f"http://127.0.0.1:{lines[0]}/json/list", timeout=30) as answer:
                        pages = [page for page in json.load(answer) if page["type"] == "page"]
                    if pages:
                        return pages[0]["webSocketDebuggerUrl"]
            time.sleep(0.1)
        raise RuntimeError("chromium does not start: " + open(self._log.name, encoding="utf-8").read()[-2000:])

    def call(self, method, **parameters):
        """Sends a command and waits for its result; events that come meanwhile are kept."""
        self._next_id += 1
        self._socket.send(json.dumps({"id": self._next_id, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == self._next_id:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            self._keep(message)

    def _keep(self, message):
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Runtime.consoleAPICalled":
            text = " ".join(str(a.get("value", a.get("description", ""))) for a in parameters["args"])
            self.console.append((parameters["type"], text))
        elif method == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.console.append(("error", details.get("exception", {}).get("description", details.get("text", ""))))
        elif method == "Log.entryAdded":
            entry = parameters["entry"]
            self.console.append((entry["level"], f"{entry.get('url', '')} {entry['text']}"))

    def open(self, url):
        self.call("Page.navigate", url=url)
        self.wait("document.readyState === 'complete'", 30)

    def eval(self, expression):
        """Value of a JavaScript expression in the page (awaited where it is a promise)."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise PageError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def wait(self, expression, seconds):
        """Waits until an expression is true; returns whether it became so."""
        deadline = time.monotonic() + seconds
        while True:
            try:
                if self.eval(expression):
                    return True
            except PageError:
                pass  # not loaded yet
            if time.monotonic() > deadline:
                return False
            time.sleep(0.1)

    def screenshot(self, path):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def cpu_seconds(self):
        """What all processes of the browser have used of the processor."""
        ticks = 0
        for entry in os.listdir("/proc"):
            if not entry.isdigit():
                continue
            try:
                with open(f"/proc/{entry}/stat", encoding="ascii") as file:
                    fields = file.read().rsplit(")", 1)[1].split()
            except OSError:
                continue  # it has just ended
            if int(fields[2]) == self._process.pid:
                ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")

    def errors(self):
        """What the page said on its console that is an error."""
        self.eval("1")
        return [text for level, text in self.console if level in ("error", "assert")]
