"""A Zenoh session that reaches no further than it must: the loopback, unless certificates say who may come in.

No discovery: the survey listens at one endpoint, nodes and robots connect to it and try again for ever. Outside the
loopback an endpoint needs TLS with certificates on both sides (`mutual TLS`): the map of the cameras of a building is
not for everybody, and a forged detection would bend it.
"""

from __future__ import annotations

import ipaddress
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from groma.errors import UserError

if TYPE_CHECKING:
    import zenoh

ENDPOINT = "127.0.0.1:7447"
_INSTALL = "the link needs Zenoh: pip install 'groma[link]'"


@dataclass(frozen=True, slots=True)
class Keys:
    """PEM files for mutual TLS."""

    authority: Path
    """Certificate of the authority that signed those of both sides."""
    certificate: Path
    key: Path


def listen(endpoint: str = ENDPOINT, keys: Keys | None = None) -> zenoh.Session:
    """Open the session that others connect to.

    Parameters
    ----------
    endpoint
        HOST:PORT.
    keys
        Needed when the host is not the loopback.

    Raises
    ------
    UserError
        When the endpoint is not of that form, is open without keys, or is taken.
    """
    return _open({"mode": "router", "listen/endpoints": [_locator(endpoint, keys)]}, endpoint, keys)


def connect(endpoint: str = ENDPOINT, keys: Keys | None = None) -> zenoh.Session:
    """Open a session with the one that listens at an endpoint, now or whenever it comes.

    Parameters, errors: as :func:`listen`.
    """
    settings = {
        "mode": "peer",
        "listen/endpoints": [],  # by default a peer would listen on all interfaces
        "connect/endpoints": [_locator(endpoint, keys)],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
    }
    return _open(settings, endpoint, keys)


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine, seen from itself."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def _locator(endpoint: str, keys: Keys | None) -> str:
    host, _, port = endpoint.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 1 << 16:
        raise UserError(f"endpoint {endpoint!r}: give HOST:PORT, like {ENDPOINT}")
    if keys is None and not is_loopback(host):
        raise UserError(
            f"endpoint {endpoint}: outside the loopback the link needs TLS: give --authority, --certificate and --key"
        )
    return f"{'tcp' if keys is None else 'tls'}/{endpoint}"


def _open(settings: dict[str, object], endpoint: str, keys: Keys | None) -> zenoh.Session:
    try:
        import zenoh
    except ModuleNotFoundError as error:
        raise UserError(_INSTALL) from error
    config = zenoh.Config()
    for name, value in {**_ALONE, **settings, **_tls(keys)}.items():
        config.insert_json5(name, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        reason = str(error).partition(" at ")[0]
        raise UserError(f"endpoint {endpoint}: cannot be opened ({reason})") from error


_ALONE: dict[str, object] = {"scouting/multicast/enabled": False, "scouting/gossip/enabled": False}


def _tls(keys: Keys | None) -> dict[str, object]:
    if keys is None:
        return {}
    for path in (keys.authority, keys.certificate, keys.key):
        if not path.is_file():
            raise UserError(f"{path}: there is no such file")
    tls = "transport/link/tls"
    certificate, key = str(keys.certificate), str(keys.key)
    return {
        f"{tls}/enable_mtls": True,
        f"{tls}/root_ca_certificate": str(keys.authority),
        f"{tls}/listen_certificate": certificate,
        f"{tls}/listen_private_key": key,
        f"{tls}/connect_certificate": certificate,
        f"{tls}/connect_private_key": key,
    }
