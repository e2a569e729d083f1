"""Who signs: keys on the curve P-256 and X.509 certificates that TLS libraries read.

One authority is for one hosts file. Whoever has its key can be any host and any run of that file;
nobody else can, and it vouches for nothing outside.
"""

import ipaddress
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

AUTHORITY_DAYS: Final = 3650
"""How long the authority is valid [d]."""

_EARLY: Final = timedelta(days=1)
"""Certificates are valid from so long ago on: clocks of other machines may be slow."""

_PURPOSES: Final = {
    True: [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH],
    False: [ExtendedKeyUsageOID.CLIENT_AUTH],
}
"""What a certificate is good for, by whether others connect to who has it."""


class UnreadableError(Exception):
    """A file is neither a certificate nor a key, as the text says."""


@dataclass(frozen=True, slots=True)
class Identity:
    """A certificate and, where it was made, its key; both as PEM.

    Attributes:
        certificate: for everybody.
        key: for its owner only; not encrypted, because nobody is there to say a password.
    """

    certificate: bytes
    key: bytes


@dataclass(frozen=True, slots=True)
class Authority:
    """What signs certificates: its own certificate, and its key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @classmethod
    def new(cls, now: datetime) -> "Authority":
        """A new one, valid for `AUTHORITY_DAYS` from `now` on."""
        key = ec.generate_private_key(ec.SECP256R1())
        name = _name("nlosim authority")
        usage = _usage(signs_certificates=True)
        certificate = (
            _builder(name, name, key, now, now + timedelta(days=AUTHORITY_DAYS))
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .sign(key, SHA256())
        )
        return cls(certificate, key)

    @classmethod
    def read(cls, identity: Identity) -> "Authority":
        """One that was made before.

        Raises:
            UnreadableError: it is none, or the key is not that of the certificate.
        """
        try:
            certificate = x509.load_pem_x509_certificate(identity.certificate)
            key = load_pem_private_key(identity.key, None)
        except ValueError as error:
            raise UnreadableError(f"cannot be read: {error}") from None
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise UnreadableError("is not a key on an elliptic curve")
        if key.public_key() != certificate.public_key():
            raise UnreadableError("is not the key of the certificate beside it")
        return cls(certificate, key)

    def identity(self) -> Identity:
        """Its certificate and key as PEM."""
        return Identity(self.certificate.public_bytes(Encoding.PEM), _pem(self.key))

    def issue(self, name: str, address: str | None, now: datetime, days: int) -> Identity:
        """A new key, and a certificate of it that this authority has signed.

        Args:
            name: of who has it.
            address: an IP address or a name under which others connect to it; `None`: nobody does.
            now: it is valid from here on.
            days: how long it is valid [d]; no longer than the authority.
        """
        key = ec.generate_private_key(ec.SECP256R1())
        until = min(now + timedelta(days=days), self.certificate.not_valid_after_utc)
        builder = (
            _builder(_name(name), self.certificate.subject, key, now, until)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(_PURPOSES[address is not None]), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(self.key.public_key()),
                critical=False,
            )
        )
        if address is not None:
            builder = builder.add_extension(
                x509.SubjectAlternativeName([_address(address)]), critical=False
            )
        certificate = builder.sign(self.key, SHA256())
        return Identity(certificate.public_bytes(Encoding.PEM), _pem(key))

    def why_not(self, pem: bytes, name: str, address: str | None, now: datetime) -> str:
        """Why a certificate cannot be that of `name` at `address`, as a predicate; empty: it can.

        Args:
            pem: the certificate.
            name: of who should have it.
            address: under which others connect to it; `None`: nobody does.
            now: when it is to be valid.
        """
        try:
            certificate = x509.load_pem_x509_certificate(pem)
        except ValueError as error:
            return f"cannot be read: {error}"
        try:
            certificate.verify_directly_issued_by(self.certificate)
        except (InvalidSignature, ValueError, TypeError):
            return "is of another authority"
        if certificate.subject != _name(name):
            return f"is that of {certificate.subject.rfc4514_string()}"
        if certificate.not_valid_after_utc <= now:
            return f"expired on {certificate.not_valid_after_utc:%Y-%m-%d}"
        if address is not None and _address(address) not in _addresses(certificate):
            found = ", ".join(str(each.value) for each in _addresses(certificate))
            return f"is for {found or 'no address'}, not for {address}"
        return ""


def expiry(pem: bytes) -> datetime:
    """When a certificate ends to be valid."""
    return x509.load_pem_x509_certificate(pem).not_valid_after_utc


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    until: datetime,
) -> x509.CertificateBuilder:
    public = key.public_key()
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _EARLY)
        .not_valid_after(until)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _address(text: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(text))
    except ValueError:
        return x509.DNSName(text)


def _addresses(certificate: x509.Certificate) -> list[x509.GeneralName]:
    try:
        return list(
            certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        )
    except x509.ExtensionNotFound:
        return []


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
