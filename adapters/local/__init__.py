"""Processes of this machine as the transport: a socket each, and arrays where all of them see them."""

from adapters.local.channel import LocalChannel
from adapters.local.transport import LocalTransport

__all__ = ["LocalChannel", "LocalTransport"]
