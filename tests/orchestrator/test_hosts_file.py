"""Hosts files: what they mean, and every mistake at its line."""

from pathlib import Path

import pytest

from orchestrator.errors import ScenarioError
from orchestrator.hosts_file import HostEndpoint, read_hosts

SOUND = """\
credentials: keys
hosts:
  gpu: {endpoint: "tls/10.0.0.3:7447"}
  partner: {endpoint: "tcp/127.0.0.1:7448"}
  six: {endpoint: "tcp/[::1]:7449"}
  open: {endpoint: "tcp/10.0.0.4:7447", insecure: true}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "hosts.yaml"
    path.write_text(SOUND)
    return path


def problems(path: Path, old: str = "", new: str = "") -> list[str]:
    """The problems after replacing text in the file, each without its path."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ScenarioError) as caught:
        read_hosts(path)
    return [str(each).removeprefix(f"{path}:") for each in caught.value.problems]


def test_what_a_file_says(file: Path) -> None:
    hosts = read_hosts(file)
    assert list(hosts.endpoints) == ["gpu", "partner", "six", "open"]
    assert hosts.endpoint("gpu") == HostEndpoint("tls", "10.0.0.3", 7447)
    assert str(hosts.endpoint("six")) == "tcp/[::1]:7449"
    assert [each.is_loopback for each in hosts.endpoints.values()] == [False, True, True, False]
    assert hosts.folder == file.parent / "keys"
    with pytest.raises(ValueError, match=r"there is no host `gpo` in .*; did you mean `gpu`\?"):
        hosts.endpoint("gpo")


def test_credentials_are_three_files_and_missing_ones_are_named(file: Path) -> None:
    folder = file.parent / "keys"
    folder.mkdir()
    (folder / "authority.pem").touch()
    with pytest.raises(ScenarioError) as caught:
        read_hosts(file).credentials("gpu")
    missing = [f"{file}:1:14: credentials: there is no file `{folder}/gpu{end}`"
               for end in (".pem", "-key.pem")]  # fmt: skip
    assert list(map(str, caught.value.problems)) == missing
    (folder / "gpu.pem").touch()
    (folder / "gpu-key.pem").touch()
    found = read_hosts(file).credentials("gpu")
    assert found is not None
    assert [each.name for each in (found.authority, found.certificate, found.key)] == [
        "authority.pem",
        "gpu.pem",
        "gpu-key.pem",
    ]


def test_a_file_without_credentials_has_none(file: Path) -> None:
    file.write_text("hosts: {a: {endpoint: 'tcp/localhost:7447'}}\n")
    assert read_hosts(file).credentials("a") is None


def test_tls_takes_credentials(file: Path) -> None:
    assert problems(file, "credentials: keys\n") == [
        "2:19: hosts.gpu.endpoint: TLS takes certificates; name their folder: `credentials: keys`"
    ]


@pytest.mark.parametrize("address", ["10.0.0.4", "192.168.1.2", "example.org", "[::]"])
def test_without_tls_only_loopback_addresses_are_taken(file: Path, address: str) -> None:
    (problem,) = problems(file, "tcp/127.0.0.1", f"tcp/{address}")
    begin = f"4:23: hosts.partner.endpoint: everybody who reaches {address} could take part"
    assert problem.startswith(begin)
    assert problem.endswith("write `tls/` and `credentials`, or `insecure: true`")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("tls/10.0.0.3:7447", "10.0.0.3", '3:19: hosts.gpu.endpoint: "10.0.0.3" is not an endp'),
        (":7447", ":77447", '3:19: hosts.gpu.endpoint: "tls/10.0.0.3:77447" is not an endpoint; w'),
        (":7447", ":0", '3:19: hosts.gpu.endpoint: "tls/10.0.0.3:0" is not an endpoint; write e.g'),
        ('"tls/10.0.0.3:7447"', "7447", "3:19: hosts.gpu.endpoint: expected an endpoint, got 7447"),
        ("endpoint:", "endpont:", "3:9: hosts.gpu: `endpont` is not a key here; did you mean `end"),
        ("  partner:", "  run:", "4:3: hosts: `run` is the name of the run in the credentials; ch"),
        ("  partner:", "  a b:", "4:3: hosts: `a b` cannot be a name; write letters, digits, `_`"),
        ("credentials: keys", "credentials: ''", "1:14: credentials: must not be empty"),
    ],
)
def test_a_mistake_is_named_at_its_place(file: Path, old: str, new: str, expected: str) -> None:
    assert any(each.startswith(expected) for each in problems(file, old, new))


def test_all_mistakes_are_named_at_once(file: Path) -> None:
    file.write_text(SOUND.replace("127.0.0.1", "10.0.0.9").replace("credentials: keys\n", ""))
    assert [each[:4] for each in problems(file)] == ["2:19", "3:23"]


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"none\.yaml:1:1: cannot be read: there is no such fi"):
        read_hosts(tmp_path / "none.yaml")


def test_a_file_without_hosts_is_refused(file: Path) -> None:
    file.write_text("hosts: {}\n")
    assert problems(file) == ["1:8: hosts: must not be empty"]
