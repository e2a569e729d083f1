"""A small authority and certificates for runs across hosts; takes the package `cryptography`."""

from adapters.keys.making import Made, make_credentials

__all__ = ["Made", "make_credentials"]
