"""C and Python write and read the same messages, and a compressed one changes nothing else."""

import contextlib
import re

import pytest
from hypothesis import example, given, strategies as st

from fmus.messages.apm import Apm, compressed_payload, decode, encode, join, message_size
from fmus.messages.apm.compression import CELLS_PER_BYTE
from fmus.messages.apm.seen_compression import SEEN_CELLS_PER_BYTE
from fmus.messages.records import APM_COMPRESSED_FLAG, APM_HEADER, APM_LEVELS_SHIFT
from tests.fmus.driver import Library, Refused
from tests.fmus.messages.apm.apms import any_apms, damaged, plain, with_header

from .harness import Outputs, Perception
from .messages import NativeCodec
from .scene import Scan, car, cloud, ground, look

COMPRESSED = 2  # item of `message`
EGO = 1


@pytest.fixture(scope="session")
def native(tmp_path_factory: pytest.TempPathFactory) -> NativeCodec:
    """The codec as built for this machine."""
    return NativeCodec(tmp_path_factory.mktemp("messages"))


def contents(apm: Apm) -> bytes:
    """Cells and layer."""
    return apm.cells.tobytes() + (b"" if apm.layer is None else apm.layer.tobytes())


# ---- one code in two languages


@given(any_apms())
def test_both_write_the_same_bytes(native: NativeCodec, apm: Apm) -> None:
    code = compressed_payload(apm)
    assert native.compress(apm, 16 * apm.cells.size) == code
    if code is not None:
        assert native.compress(apm, len(code)) == code
        assert native.compress(apm, len(code) - 1) is None


@given(apm=any_apms(), compressed=st.booleans())
def test_both_read_the_same_matrix(native: NativeCodec, apm: Apm, *, compressed: bool) -> None:
    assert native.decode(encode(apm, compressed=compressed)) == contents(apm)


@given(any_apms(), st.data())
def test_both_refuse_a_damaged_message_or_read_the_same(
    native: NativeCodec, apm: Apm, data: st.DataObject
) -> None:
    message = damaged(encode(apm, compressed=True), data, shortest=APM_HEADER.itemsize)
    check_agreement(native, message)


@given(
    payload=st.binary(max_size=200),
    rows=st.integers(1, 80),
    columns=st.integers(1, 80) | st.integers(1, 65535),
    layer=st.booleans(),
)
@example(payload=b"\x1f" * 100, rows=64, columns=50, layer=True)
@example(payload=b"\x1f" * 100, rows=65535, columns=65535, layer=True)
@example(payload=b"", rows=1, columns=1, layer=False)
def test_both_agree_on_noise(
    native: NativeCodec, payload: bytes, *, rows: int, columns: int, layer: bool
) -> None:
    flags = APM_COMPRESSED_FLAG | int(layer)
    check_agreement(native, with_header(payload, rows=rows, columns=columns, flags=flags))
    assert native.taken <= 2 * 8 * CELLS_PER_BYTE * len(payload) + 16


@given(
    payload=st.binary(max_size=200) | st.binary(max_size=4),
    rows=st.integers(1, 30),
    columns=st.integers(1, 30) | st.integers(1, 65535),
    levels=st.integers(0, 4) | st.integers(1, 255),
    flags=st.integers(0, 3),
)
@example(payload=b"\0", rows=128, columns=128, levels=3, flags=2)
@example(payload=b"\0", rows=128, columns=129, levels=3, flags=2)
@example(payload=bytes(60), rows=1000, columns=1000, levels=3, flags=3)
@example(payload=b"\xff" * 200, rows=30, columns=30, levels=255, flags=3)
@example(payload=b"", rows=1, columns=1, levels=1, flags=2)
@example(payload=b"\4\0\0\0", rows=1, columns=1, levels=3, flags=0)
def test_both_agree_on_noise_with_levels(
    native: NativeCodec, payload: bytes, *, rows: int, columns: int, levels: int, flags: int
) -> None:
    flags |= levels << APM_LEVELS_SHIFT
    check_agreement(native, with_header(payload, rows=rows, columns=columns, flags=flags))
    room = 2 * 8 * min(rows * columns, SEEN_CELLS_PER_BYTE * len(payload))
    assert native.taken <= room + 16


@given(payload=st.binary(min_size=1, max_size=3), levels=st.integers(1, 3), layer=st.booleans())
def test_both_agree_on_codes_of_a_few_bytes(
    native: NativeCodec, payload: bytes, levels: int, *, layer: bool
) -> None:
    """Of which many are a matrix."""
    flags = levels << APM_LEVELS_SHIFT | APM_COMPRESSED_FLAG | int(layer)
    check_agreement(native, with_header(payload, rows=1, columns=2, flags=flags))


def check_agreement(native: NativeCodec, message: bytes) -> None:
    """Both read the same, or refuse with the same words."""
    try:
        expected = contents(decode(message))
    except ValueError as error:
        with pytest.raises(Refused, match=f"^{re.escape(str(error))}$"):
            native.decode(message)
    else:
        assert native.decode(message) == expected


# ---- the messages of the FMU


def drive(k: int) -> bytes:
    """What two sensors see of cars and of the road in step `k`."""
    boxes = [car(5, 14 - 0.9 * k, 7), car(6, -20 + 1.3 * k, -5, height=3.0)]
    first = look(EGO, (0.3 * k, 0.0), boxes, time=k * 10**8)
    second = Scan(
        vehicle=2, points=ground(-30, 30), position=(25.0, 3.0 - 0.4 * k, 2.0), time=k * 10**8
    )
    return cloud(first, second)


SEEN_AREA = {"index": 2, "index_levels": 15, "seen_benefit_threshold": 0.1}
"""Settings with shares of seen ground. The scans of `drive` are not of the lidar's pattern, which
does not matter here."""


def outputs(library: Library, steps: int = 5, /, **settings: float) -> list[Outputs]:
    """The outputs of some steps, in each of which all APMs of the last one arrive."""
    found: list[Outputs] = []
    with Perception(library, benefit_threshold=1.0, **settings) as unit:
        for k in range(steps):
            received = join(found[-1].messages) if found else b""
            found.append(unit.step(drive(k), received, ego=EGO))
    return found


@pytest.mark.parametrize("layer", [False, True])
@pytest.mark.parametrize("rows", [1, 20, 37])
@pytest.mark.parametrize("index", [{}, SEEN_AREA], ids=["points", "seen_area"])
def test_the_compressed_messages_carry_what_the_plain_ones_do(
    library: Library, rows: int, index: dict[str, float], *, layer: bool
) -> None:
    usual = outputs(library, layer=layer, rows=rows, **index)
    found = outputs(library, layer=layer, rows=rows, message=COMPRESSED, **index)
    for one, other in zip(usual, found, strict=True):
        assert {apm.levels for apm in other.apms} == {int(index.get("index_levels", 0))}
        assert other.messages == [encode(apm, compressed=True) for apm in one.apms]
        assert [encode(apm) for apm in other.apms] == one.messages
        assert sum(map(len, other.messages)) < sum(map(len, one.messages))


@pytest.mark.parametrize("index", [{}, SEEN_AREA], ids=["points", "seen_area"])
def test_matching_is_the_same_with_compressed_messages(
    library: Library, index: dict[str, float]
) -> None:
    usual, found = outputs(library, **index), outputs(library, message=COMPRESSED, **index)
    assert usual[-1].sharers.tolist() == [2]
    for one, other in zip(usual, found, strict=True):
        assert other.sharers.tolist() == one.sharers.tolist()
        assert other.benefits.tobytes() == one.benefits.tobytes()
        assert other.objects_signal == one.objects_signal


def test_a_state_with_compressed_messages_is_restored(library: Library) -> None:
    with Perception(library, benefit_threshold=1.0, message=COMPRESSED) as unit:
        sent = unit.step(drive(0), ego=EGO).messages
        unit.step(drive(1), join(sent), ego=EGO)
        state, time = unit.save(), unit.time
        expected = unit.step(drive(2), ego=EGO)
    assert expected.sharers.tolist() == [2]
    with Perception(library, benefit_threshold=1.0, message=COMPRESSED) as other:
        other.begin()
        other.restore(state)
        other.time = time
        assert other.step(drive(2), ego=EGO).benefits.tobytes() == expected.benefits.tobytes()


def test_the_plain_form_is_the_default(library: Library) -> None:
    for message in outputs(library, 1)[0].messages:
        assert len(message) == message_size(20, 20, layer=True)


@pytest.mark.parametrize(
    ("message", "wrong"),
    [
        (with_header(b"\4", flags=2), "message 0 is dropped: a compressed APM is cut short"),
        (with_header(b"\5\0", flags=2), "a compressed APM has 1 bytes too many"),
        (with_header(b"\5", flags=2, rows=1024, columns=1024), "does not fit into 73 bytes"),
        (with_header(b"", flags=2, rows=65535, columns=65535), "too large: at most 1048576 cells"),
        (with_header(b"", flags=4), "unknown flags 0x0004"),
        (with_header(b"\4", flags=0x302, rows=1, columns=1), "ends in other bytes than its cells"),
        (
            with_header(b"\4\0\0\0", flags=0x300, rows=1, columns=1),
            "an APM of 3 levels has a cell of 4",
        ),
    ],
)
def test_a_malformed_message_is_dropped_with_a_warning(
    library: Library, message: bytes, wrong: str
) -> None:
    good = encode(plain(), compressed=True)
    with Perception(library) as unit:
        unit.begin()
        unit.set_inputs(drive(0), join([message, good]), ego=EGO)
        (warning,) = unit.advance()
    assert wrong in warning


@given(st.lists(st.binary(max_size=60), max_size=3), st.integers(1, 9), st.integers(1, 9))
def test_the_unit_survives_compressed_noise(
    library: Library, payloads: list[bytes], rows: int, columns: int
) -> None:
    received = [with_header(p, flags=3, rows=rows, columns=columns) for p in payloads]
    with Perception(library) as unit, contextlib.suppress(Refused):
        unit.step(drive(0), join(received), ego=EGO)
