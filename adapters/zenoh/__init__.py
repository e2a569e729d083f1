"""Zenoh as the transport to components in other processes."""

from adapters.zenoh.channel import ZenohChannel
from adapters.zenoh.network import ZenohNetwork
from adapters.zenoh.transport import ZenohTransport

__all__ = ["ZenohChannel", "ZenohNetwork", "ZenohTransport"]
