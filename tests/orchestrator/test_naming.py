"""Values that are named instead of sent: who knows them, how long, and what goes over the line."""

from collections.abc import Mapping

import numpy as np
import pytest

from orchestrator.remote.block import WireError, entries, replaced
from orchestrator.remote.naming import LEAST, Name, Origins, Sites
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.serving.shelf import Shelf, Shelves
from orchestrator.signal import Causality, Connector, Signal

OUTPUTS: Mapping[str, Connector] = {
    "small": Connector(causality=Causality.OUTPUT),
    "field": Connector(causality=Causality.OUTPUT, shape=("n", 3)),
    "text": Connector(causality=Causality.OUTPUT, dtype=None),
}
INPUTS: Mapping[str, Connector] = {
    "before": Connector(causality=Causality.INPUT),
    "scan": Connector(causality=Causality.INPUT, dtype=None),
    "grid": Connector(causality=Causality.INPUT, shape=("n", 3)),
    "whole": Connector(causality=Causality.INPUT, dtype=np.int64, shape=("n", 3)),
}


class Maker:
    """A component on a host, the server there, and the run, as far as values are concerned."""

    def __init__(self, shelf: Shelf, origins: Origins, name: str = "maker") -> None:
        self._encoder, self._decoder = SignalEncoder(OUTPUTS), SignalDecoder(OUTPUTS)
        self._shelf, self._origins, self._name = shelf, origins, name
        self.epoch, self.sequence = 1, 0
        origins.begin(name, OUTPUTS)

    def gives(self, *, is_heard: bool = True, **values: Signal) -> dict[str, Signal]:
        """What the run has of these outputs, once it has heard the reply to the next step."""
        self.sequence += 1
        command = Message(Kind.STEP, self.epoch, self.sequence)
        reply = command.reply(Kind.DONE, {}).encode(self._encoder.parts(values))
        self._shelf.keep(self._name, command, reply)
        if not is_heard:
            return {}
        found = self._decoder.decode(reply, Message.decode(reply)[1])
        self._origins.note(self._name, found, command.reply(Kind.DONE, {}))
        return found


def step(encoder: SignalEncoder, **values: Signal) -> tuple[Message, bytes]:
    command = Message(Kind.STEP, 1, 1, t=10, h=10, document={"why": "a document goes before"})
    return command, command.encode(encoder.parts(values))


def test_what_is_named_arrives_bit_for_bit_and_is_not_sent() -> None:
    shelf, origins = Shelf(), Origins()
    maker = Maker(shelf, origins)
    field, text = np.linspace(-1.0, 1.0, 999).reshape(333, 3), bytes(range(256)) * 5
    had = maker.gives(small=np.array(2.5), field=field, text=text)
    encoder, decoder = SignalEncoder(INPUTS, name_of=origins.name_of), SignalDecoder(INPUTS)
    command, sent = step(encoder, before=had["small"], scan=had["text"], grid=had["field"])
    assert len(sent) < 300
    filled = shelf.fill(command, sent)
    assert Message.decode(filled)[0] == command
    there = decoder.decode(filled, Message.decode(filled)[1])
    assert np.asarray(there["before"]) == 2.5
    assert there["scan"] == text
    grid = np.asarray(there["grid"])
    assert (grid.shape, grid.dtype.str, grid.tobytes()) == ((333, 3), "<f8", field.tobytes())
    command, sent = step(encoder, grid=had["field"])  # the same object once more
    again = decoder.decode(shelf.fill(command, sent), Message.decode(sent)[1])
    assert again["grid"] is there["grid"]


def test_only_the_newest_value_is_named_and_only_the_very_object() -> None:
    origins = Origins()
    maker = Maker(Shelf(), origins)
    field = np.ones((100, 3))
    old = maker.gives(field=field)["field"]
    assert origins.name_of(old) == Name("maker", 1, 1, 1).encode()
    assert origins.name_of(np.array(old)) is None
    assert maker.gives(field=field)["field"] is old
    assert origins.name_of(old) == Name("maker", 1, 1, 1).encode()  # not sent again
    new = maker.gives(field=field + 1.0)["field"]
    assert origins.name_of(old) is None
    assert origins.name_of(new) == Name("maker", 1, 1, 3).encode()
    origins.forget("another")
    assert origins.name_of(new) is not None
    origins.forget("maker")
    assert origins.name_of(new) is None


@pytest.mark.parametrize(("length", "is_named"), [(LEAST - 1, False), (LEAST, True)])
def test_small_values_travel(length: int, *, is_named: bool) -> None:
    origins = Origins()
    found = Maker(Shelf(), origins).gives(text=bytes(length))["text"]
    assert (origins.name_of(found) is not None) == is_named


def test_a_value_of_another_element_type_travels_so_that_its_receiver_can_complain() -> None:
    origins = Origins()
    found = Maker(Shelf(), origins).gives(field=np.ones((100, 3)))["field"]
    command, sent = step(SignalEncoder(INPUTS, name_of=origins.name_of), whole=found)
    assert len(sent) > 2400
    assert Shelf().fill(command, sent) == sent


def test_two_values_of_an_output_are_kept_for_the_run_may_be_one_reply_behind() -> None:
    shelf, origins = Shelf(), Origins()
    maker = Maker(shelf, origins)
    encoder = SignalEncoder(INPUTS, name_of=origins.name_of)
    had = maker.gives(field=np.full((50, 3), 1.0))["field"]
    message = step(encoder, grid=had)
    maker.gives(is_heard=False, field=np.full((50, 3), 2.0))
    filled = shelf.fill(*message)
    there = SignalDecoder(INPUTS).decode(filled, Message.decode(filled)[1])
    assert np.asarray(there["grid"])[0, 0] == 1.0
    maker.gives(is_heard=False, field=np.full((50, 3), 3.0))
    with pytest.raises(WireError, match="names a value of `maker` that is not here"):
        shelf.fill(*message)


def test_a_component_that_starts_anew_leaves_what_it_gave_before() -> None:
    """Its values of an earlier epoch may still be named by commands that are on their way."""
    shelf, origins = Shelf(), Origins()
    maker = Maker(shelf, origins)
    had = maker.gives(field=np.full((50, 3), 1.0))["field"]
    message = step(SignalEncoder(INPUTS, name_of=origins.name_of), grid=had)
    again = Maker(shelf, origins)
    again.epoch, again.sequence = 2, 7
    again.gives(field=np.full((50, 3), 5.0))
    filled = shelf.fill(*message)
    there = SignalDecoder(INPUTS).decode(filled, Message.decode(filled)[1])
    assert np.asarray(there["grid"])[0, 0] == 1.0


def test_runs_do_not_see_what_others_gave() -> None:
    shelves, origins = Shelves(), Origins()
    with shelves.shelf("one") as mine, shelves.shelf("two") as other:
        had = Maker(mine, origins).gives(text=bytes(300))["text"]
        message = step(SignalEncoder(INPUTS, name_of=origins.name_of), scan=had)
        with pytest.raises(WireError, match="not here"):
            other.fill(*message)
        with shelves.shelf("one") as same:
            assert same is mine
        assert mine.fill(*message) != message[1]
    with shelves.shelf("one") as later, pytest.raises(WireError, match="not here"):
        later.fill(*message)


def test_sites_do_not_see_what_others_gave_and_one_that_is_alone_names_nothing() -> None:
    sites = Sites()
    here = sites.come_to("here", "maker", OUTPUTS)
    there = sites.come_to("there", "taker", ())
    found = Maker(Shelf(), here).gives(text=bytes(300))["text"]
    assert here.name_of(found) is not None
    assert there.name_of(found) is None
    assert sites.come_to("here", "taker", ()) is here
    assert sites.come_to("", "taker", ()) is not sites.come_to("", "other", ())
    sites.come_to("there", "maker", OUTPUTS)
    assert here.name_of(found) is None


@pytest.mark.parametrize("raw", [b"", bytes(15), bytes(16) + b"\xff"])
def test_what_is_no_name_is_refused(raw: bytes) -> None:
    with pytest.raises(WireError, match="no name of a value"):
        Name.decode(raw)


def test_entries_are_those_of_the_block_and_put_together_make_it_again() -> None:
    values: dict[str, Signal] = {
        "small": np.array(1.0),
        "field": np.arange(9.0).reshape(3, 3),
        "text": b"abc",
    }
    encoder = SignalEncoder(OUTPUTS)
    for again in (False, True):
        block = bytes(16) + b"".join(map(bytes, encoder.parts(values)))
        found = list(entries(block, 16))
        assert [each.number for each in found] == [0, 1, 2]
        assert [each.length for each in found] == ([0, 0, 0] if again else [8, 72, 3])
        assert replaced(block, 16, found) == block
    for wrong in (block[:-1], block + bytes(16), block[:24]):
        with pytest.raises(WireError):
            list(entries(wrong, 16))
    foreign = SignalEncoder(OUTPUTS).parts({"field": np.ones((3, 3), np.float32)})
    whole = b"".join(map(bytes, foreign))
    assert replaced(whole, 0, list(entries(whole, 0))) == whole
