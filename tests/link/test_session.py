from __future__ import annotations

import shutil
import socket
import subprocess
import threading
from pathlib import Path

import pytest
import zenoh

from groma.errors import UserError
from groma.link.session import Keys, connect, is_loopback, listen


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port


def openssl(*words: str, folder: Path) -> None:
    subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)  # noqa: S607


def authority(folder: Path) -> None:
    """Make the certificate of an authority: ca.pem, ca.key."""
    words = "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=authority -keyout ca.key -out ca.pem"
    openssl(*words.split(" "), "-addext", "basicConstraints=critical,CA:TRUE", folder=folder)


def keys(folder: Path, name: str, signed_in: Path | None = None) -> Keys:
    """Make a key and a certificate for this machine, signed by the authority in a folder."""
    signer = signed_in or folder
    openssl(*f"req -newkey rsa:2048 -nodes -subj /CN={name} -keyout {name}.key -out {name}.csr".split(), folder=folder)
    (folder / "san").write_text("subjectAltName=IP:127.0.0.1,DNS:localhost\n")
    sign = f"x509 -req -days 2 -in {name}.csr -CA {signer}/ca.pem -CAkey {signer}/ca.key -CAcreateserial"
    openssl(*sign.split(), "-extfile", "san", "-out", f"{name}.pem", folder=folder)
    return Keys(folder / "ca.pem", folder / f"{name}.pem", folder / f"{name}.key")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "[::1]", "localhost"])
def test_the_loopback_is_known(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("endpoint", ["0.0.0.0:7447", "192.168.1.4:7447", "[::]:7447", "robot.example:7447"])
def test_outside_the_loopback_nothing_is_opened_without_keys(endpoint: str) -> None:
    for opened in (listen, connect):
        with pytest.raises(UserError, match="TLS"):
            opened(endpoint)


@pytest.mark.parametrize("endpoint", ["", "7447", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000"])
def test_what_is_no_endpoint_is_told(endpoint: str) -> None:
    with pytest.raises(UserError, match="HOST:PORT"):
        listen(endpoint)


def test_a_port_that_is_taken_is_told() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(UserError, match="cannot be opened"):
            listen(f"127.0.0.1:{taken.getsockname()[1]}")


def test_keys_that_are_not_there_are_told(tmp_path: Path) -> None:
    missing = tmp_path / "ca.pem"
    with pytest.raises(UserError, match=r"ca\.pem: there is no such file"):
        listen("127.0.0.1:7447", Keys(missing, missing, missing))


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make certificates with")
def test_with_keys_only_those_whom_the_authority_signed_are_heard(tmp_path: Path) -> None:
    home, foreign = tmp_path / "home", tmp_path / "foreign"
    for folder in (home, foreign):
        folder.mkdir()
        authority(folder)
    stranger = Keys(home / "ca.pem", *_own(keys(foreign, "stranger")))
    endpoint = f"127.0.0.1:{free_port()}"
    heard: list[str] = []
    arrived = threading.Event()

    def hear(sample: zenoh.Sample) -> None:
        heard.append(sample.payload.to_string())
        arrived.set()

    with listen(endpoint, keys(home, "survey")) as survey:
        survey.declare_subscriber("greeting", hear)
        with connect(endpoint, stranger) as out, connect(endpoint, keys(home, "camera")) as camera:
            for _ in range(100):
                out.put("greeting", "stranger")
                camera.put("greeting", "camera")
                if arrived.wait(0.05):
                    break
    assert set(heard) == {"camera"}


def _own(made: Keys) -> tuple[Path, Path]:
    return made.certificate, made.key
