"""`nlosim keys`: what it makes, what it never touches, and what is wrong with what is there."""

import json
import stat
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cryptography", reason="cryptography is not installed")

from cryptography import x509
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from adapters.keys import make_credentials
from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.hosts_file import Hosts, read_hosts

NOW = datetime(2030, 1, 2, 3, 4, 5, tzinfo=UTC)
HOSTS = """\
credentials: keys
hosts:
  gpu: {endpoint: "tls/10.0.0.3:7447"}
  six: {endpoint: "tls/[fd00::1]:7447"}
  partner: {endpoint: "tls/partner.example.org:7448"}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "hosts.yaml"
    path.write_text(HOSTS)
    return path


@pytest.fixture
def hosts(file: Path) -> Hosts:
    return read_hosts(file)


def certificate(hosts: Hosts, name: str) -> x509.Certificate:
    assert hosts.folder is not None
    return x509.load_pem_x509_certificate((hosts.folder / f"{name}.pem").read_bytes())


def uses(found: x509.Certificate) -> set[str]:
    usage = found.extensions.get_extension_for_class(x509.KeyUsage)
    assert usage.critical
    names = ("digital_signature", "key_cert_sign", "crl_sign", "content_commitment",
             "key_encipherment", "data_encipherment", "key_agreement")  # fmt: skip
    return {name for name in names if getattr(usage.value, name)}


def addresses(found: x509.Certificate) -> list[str]:
    try:
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [str(each.value) for each in names]


def test_each_host_has_a_certificate_for_its_name_and_its_address_only(hosts: Hosts) -> None:
    made = make_credentials(hosts, NOW, 30)
    assert [each.name for each in made] == ["authority", "run", "gpu", "six", "partner"]
    assert all(each.is_new for each in made)
    expected = {
        "run": [],
        "gpu": ["10.0.0.3"],
        "six": ["fd00::1"],
        "partner": ["partner.example.org"],
    }
    authority = certificate(hosts, "authority")
    keys = set()
    for name, names in expected.items():
        found = certificate(hosts, name)
        assert found.subject.rfc4514_string() == f"CN={name}"
        assert addresses(found) == names
        found.verify_directly_issued_by(authority)
        purposes = found.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        serves = any(each.dotted_string == "1.3.6.1.5.5.7.3.1" for each in purposes)
        assert serves == (name != "run")  # nobody who starts runs can pass for a host
        constraints = found.extensions.get_extension_for_class(x509.BasicConstraints)
        assert constraints.critical
        assert not constraints.value.ca  # nobody can make further ones
        assert uses(found) == {"digital_signature"}
        credentials = hosts.credentials(name)
        assert credentials is not None
        key = load_pem_private_key(credentials.key.read_bytes(), None)
        assert key.public_key() == found.public_key()
        keys.add(credentials.key.read_bytes())
    assert len(keys) == 4
    assert uses(authority) == {"key_cert_sign", "crl_sign"}
    assert authority.extensions.get_extension_for_class(x509.BasicConstraints).value.ca


def test_how_long_they_are_valid(hosts: Hosts) -> None:
    """From a day ago on, since clocks differ; none longer than the authority."""
    made = make_credentials(hosts, NOW, 30)
    assert [(each.until - NOW).days for each in made] == [3650, 30, 30, 30, 30]
    assert certificate(hosts, "gpu").not_valid_before_utc == NOW - timedelta(days=1)
    assert hosts.folder is not None
    for name in ("gpu.pem", "gpu-key.pem"):
        (hosts.folder / name).unlink()
    later = make_credentials(hosts, NOW + timedelta(days=20), 3640)
    assert (later[2].until - NOW).days == 3650


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such modes")
def test_keys_are_for_their_owner_only(hosts: Hosts) -> None:
    """Whatever the mask is, and again if somebody has opened them to others."""
    made = make_credentials(hosts, NOW, 30)
    folder = made[0].files[0].parent
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    for each in made:
        assert stat.S_IMODE(each.files[1].stat().st_mode) == 0o600
        assert b"PRIVATE" not in each.files[0].read_bytes()
        each.files[1].chmod(0o644)
    for each in make_credentials(hosts, NOW, 30):
        assert stat.S_IMODE(each.files[1].stat().st_mode) == 0o600


def test_what_is_there_stays_and_what_is_missing_is_made(file: Path, hosts: Hosts) -> None:
    first = make_credentials(hosts, NOW, 30)
    before = {path: path.read_bytes() for each in first for path in each.files}
    file.write_text(HOSTS + '  more: {endpoint: "tls/10.0.0.9:7447"}\n')
    second = make_credentials(read_hosts(file), NOW, 30)
    assert [each.name for each in second if each.is_new] == ["more"]
    assert {path: path.read_bytes() for path in before} == before
    certificate(hosts, "more").verify_directly_issued_by(certificate(hosts, "authority"))


def problems(hosts: Hosts, now: datetime = NOW) -> list[str]:
    """What is wrong, without the paths; nothing is written then."""
    assert hosts.folder is not None
    before = {path: path.stat().st_mtime_ns for path in hosts.folder.iterdir()}
    with pytest.raises(ScenarioError) as caught:
        make_credentials(hosts, now, 30)
    assert {path: path.stat().st_mtime_ns for path in hosts.folder.iterdir()} == before
    texts = [str(each) for each in caught.value.problems]
    return [each.replace(f"{hosts.folder}/", "").replace(f"{hosts.path}:", "") for each in texts]


AGAIN = "; move it and its key away to have them made again"


def test_all_that_does_not_fit_is_named_with_its_line(file: Path, hosts: Hosts) -> None:
    make_credentials(hosts, NOW, 30)
    assert hosts.folder is not None
    file.write_text(HOSTS.replace("10.0.0.3", "10.0.0.4").replace("[fd00::1]", "six.example"))
    (hosts.folder / "partner.pem").write_text("nonsense")
    (hosts.folder / "run-key.pem").unlink()
    found = problems(read_hosts(file))
    assert found[0] == f"1:14: credentials: `run.pem` is here, but its key is not{AGAIN}"
    assert found[1] == f"3:3: hosts.gpu: `gpu.pem` is for 10.0.0.3, not for 10.0.0.4{AGAIN}"
    assert found[2] == f"4:3: hosts.six: `six.pem` is for fd00::1, not for six.example{AGAIN}"
    assert found[3].startswith("5:3: hosts.partner: `partner.pem` cannot be read: ")
    assert len(found) == 4


def test_what_has_expired_is_named(hosts: Hosts) -> None:
    make_credentials(hosts, NOW, 30)
    almost = NOW + timedelta(days=30) - timedelta(seconds=1)
    assert not any(each.is_new for each in make_credentials(hosts, almost, 30))
    found = problems(hosts, NOW + timedelta(days=30))
    assert found[1] == f"3:3: hosts.gpu: `gpu.pem` expired on 2030-02-01{AGAIN}"
    assert len(found) == 4


def test_certificates_of_somebody_else_are_named(hosts: Hosts, tmp_path: Path) -> None:
    make_credentials(hosts, NOW, 30)
    assert hosts.folder is not None
    other = tmp_path / "other" / "hosts.yaml"
    other.parent.mkdir()
    other.write_text(HOSTS)
    make_credentials(read_hosts(other), NOW, 30)
    for name in ("gpu.pem", "gpu-key.pem"):
        (other.parent / "keys" / name).replace(hosts.folder / name)
    for ending in (".pem", "-key.pem"):
        (hosts.folder / f"six{ending}").replace(hosts.folder / f"kept{ending}")
        (hosts.folder / f"partner{ending}").replace(hosts.folder / f"six{ending}")
        (hosts.folder / f"kept{ending}").replace(hosts.folder / f"partner{ending}")
    assert problems(hosts) == [
        f"3:3: hosts.gpu: `gpu.pem` is of another authority{AGAIN}",
        f"4:3: hosts.six: `six.pem` is that of CN=partner{AGAIN}",
        f"5:3: hosts.partner: `partner.pem` is that of CN=six{AGAIN}",
    ]


@pytest.mark.parametrize(
    ("file_of", "content", "why"),
    [
        ("authority-key.pem", None, "is missing; certificates are made where the authority was"),
        ("authority.pem", None, "is here, but `authority.pem` is not"),
        ("authority-key.pem", "nonsense", "cannot be read: "),
        ("authority-key.pem", "run-key.pem", "is not the key of the certificate beside it"),
    ],
)
def test_without_its_authority_nothing_is_made(
    hosts: Hosts, file_of: str, content: str | None, why: str
) -> None:
    """As on a machine that got its credentials from another one."""
    make_credentials(hosts, NOW, 30)
    assert hosts.folder is not None
    path = hosts.folder / file_of
    if content is None:
        path.unlink()
    elif content.endswith(".pem"):
        path.write_bytes((hosts.folder / content).read_bytes())
    else:
        path.write_text(content)
    (problem,) = problems(hosts)
    assert problem.startswith(f"1:14: credentials: `authority-key.pem` {why}")


def test_a_file_that_names_no_folder(file: Path) -> None:
    file.write_text('hosts: {a: {endpoint: "tcp/127.0.0.1:7447"}}\n')
    with pytest.raises(ScenarioError, match=r"hosts.yaml:1:1: the file names no folder for them"):
        make_credentials(read_hosts(file), NOW, 30)
    assert not (file.parent / "keys").exists()


def test_the_command_says_what_it_made(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", str(file), "--days", "20"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"{file.parent / 'keys'}:"
    assert said[1].startswith("  authority  made, valid until ")
    assert said[3].startswith("  gpu        made, valid until ")
    assert said[3].endswith(", in 20 days")
    assert said[-1].startswith("give each machine `authority.pem`")
    assert main(["keys", str(file), "--json"]) == 0
    data: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert data["folder"] == str(file.parent / "keys")
    assert [each["is_new"] for each in data["credentials"]] == [False] * 5
    assert data["credentials"][2]["key"] == "gpu-key.pem"


@pytest.mark.parametrize("days", ["0", "3651", "-1", "1.5", "many"])
def test_days_are_a_sensible_number(
    file: Path, days: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["keys", str(file), f"--days={days}"]) == 2
    assert f"expected 1 to 3650 days, got `{days}`" in capsys.readouterr().err
    assert not (file.parent / "keys").exists()


def test_without_the_package_the_command_says_what_to_install(
    file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("adapters.keys", "adapters.keys.making", "adapters.keys.authority"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "cryptography", None)
    assert main(["keys", str(file)]) == 2
    assert "pip install 'nlosim[keys]'" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["authority", "gpu-key"])
def test_no_host_has_the_name_of_another_file(file: Path, name: str) -> None:
    file.write_text(HOSTS.replace("partner:", f"{name}:"))
    with pytest.raises(ScenarioError, match=f"5:3: hosts: `{name}.pem` is another file of the"):
        read_hosts(file)
