"""A headless Chromium that tests drive through its debugging pipe; no further package is needed."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "chrome")
PROGRAM = next((path for name in PROGRAMS if (path := shutil.which(name))), None)
"""The installed browser, if there is one."""
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
    "--remote-debugging-pipe",
]


class Tab:
    """One page in a browser."""

    def __init__(self, writing: int, reading: int) -> None:
        self.writing, self.reading = os.fdopen(writing, "wb", buffering=0), os.fdopen(reading, "rb", buffering=0)
        self.count, self.session, self.received = 0, "", b""
        self.messages: list[dict[str, Any]] = []
        """Events so far, e.g. requests and errors of the page."""
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.send(f"{domain}.enable")

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        self.count += 1
        message: dict[str, Any] = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.writing.write(json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self.count:
                assert "error" not in answer, answer
                result: dict[str, Any] = answer["result"]
                return result
            self.messages.append(answer)

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self.received:
            part = self.reading.read(1 << 16)
            assert part, "the browser ended"
            self.received += part
        message, self.received = self.received.split(b"\0", 1)
        answer: dict[str, Any] = json.loads(message)
        return answer

    def open(self, path: Path, width: int = 1400, height: int = 1000, dark: bool = False) -> None:
        """Open a file in a window of this size and wait until its scripts say that it is ready."""
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.send("Emulation.setEmulatedMedia", features=[scheme])
        self.send("Page.navigate", url=path.resolve().as_uri())
        while self.messages[-1].get("method") != "Page.loadEventFired":
            self.messages.append(self._receive())
        self.until("document.documentElement.dataset.ready === 'yes'")

    def until(self, condition: str) -> None:
        """Wait until a condition on the page holds."""
        look = f"const look = () => {condition} ? done(true) : requestAnimationFrame(look)"
        self.run(f"new Promise((done) => {{ {look}; look(); }})")

    def run(self, script: str) -> Any:
        """Return the value of a script, or of the promise that it returns."""
        result = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Move, press or release the left button of the mouse."""
        buttons = 0 if kind == "mouseReleased" else 1
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def key(self, name: str) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=name, code=name)

    def picture(self, path: Path) -> None:
        """Write a picture of the whole page."""
        shot = self.send("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))

    def errors(self) -> list[str]:
        """Return what the page's console reported as errors so far."""
        found = [message for message in self.messages if message.get("method") == "Runtime.exceptionThrown"]
        logged = [message["params"]["entry"] for message in self.messages if message.get("method") == "Log.entryAdded"]
        return [str(message) for message in found] + [str(entry) for entry in logged if entry["level"] == "error"]

    def requests(self) -> list[str]:
        """Return the addresses that were asked for so far, data within the page left out."""
        sent = [message for message in self.messages if message.get("method") == "Network.requestWillBeSent"]
        addresses = [message["params"]["request"]["url"] for message in sent]
        return [address for address in addresses if not address.startswith(("data:", "blob:"))]


@contextmanager
def chromium(profile: Path) -> Iterator[Tab]:
    """Start a browser with a new profile in the folder `profile`, and end it afterwards."""
    assert PROGRAM is not None
    to_browser, writing = os.pipe()
    reading, from_browser = os.pipe()

    def as_its_pipes() -> None:  # the browser reads commands from file 3 and writes answers to file 4
        os.dup2(to_browser, 10)
        os.dup2(from_browser, 11)
        os.dup2(10, 3)
        os.dup2(11, 4)

    process = subprocess.Popen(
        [PROGRAM, *FLAGS, f"--user-data-dir={profile}"],
        preexec_fn=as_its_pipes,
        pass_fds=(to_browser, from_browser, 3, 4),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(to_browser)
    os.close(from_browser)
    try:
        yield Tab(writing, reading)
    finally:
        process.terminate()
        process.wait()
