"""What counts how much when the expert is imitated."""

import pytest
import torch
from hypothesis import given, strategies as st
from torch import Tensor

from studies.training.learning.decision import imitation_loss

COMMANDS = st.lists(st.floats(-1.0, 1.0, width=16), min_size=3, max_size=3)
MOMENTS = st.lists(
    st.tuples(COMMANDS, COMMANDS, st.booleans(), st.booleans()), min_size=1, max_size=6
)
Moment = tuple[list[float], list[float], bool, bool]


def loss(moments: list[Moment], weight: float = 8.0) -> Tensor:
    """Of moments of: command, the expert's, whether it yields, whether that can be seen."""
    command, expert, yields, sees = zip(*moments, strict=True)
    return imitation_loss(
        torch.tensor(command),
        torch.tensor(expert),
        torch.tensor(yields),
        torch.tensor(sees),
        weight,
    )


def repeated(moment: Moment) -> list[Moment]:
    """As often as it counts."""
    _, expert, yields, sees = moment
    if yields:
        return [moment] * (8 * sees)
    return [moment] * (3 if expert[0] > 0.1 else 1)


@given(moments=MOMENTS)
def test_a_weight_is_so_many_equal_moments(moments: list[Moment]) -> None:
    errors = [
        sum(abs(a - b) for a, b in zip(moment[0], moment[1], strict=True))
        for each in moments
        for moment in repeated(each)
    ]
    wanted = sum(errors) / max(len(errors), 1)
    assert float(loss(moments)) == pytest.approx(wanted, abs=1e-5)


def test_nothing_is_learned_where_the_threat_cannot_be_seen() -> None:
    command = torch.tensor([[0.3, 0.0, 0.0], [0.3, 0.0, 0.0]], requires_grad=True)
    expert = torch.tensor([[0.0, 0.8, 0.0], [0.0, 0.0, 0.0]])
    unseen = imitation_loss(
        command, expert, torch.tensor([True, False]), torch.tensor([False, False]), 8.0
    )
    (slope,) = torch.autograd.grad(unseen, command)
    assert slope[0].tolist() == [0.0, 0.0, 0.0]
    assert slope[1].tolist() == [1.0, 0.0, 0.0]


def test_a_batch_in_which_nothing_counts_has_no_loss() -> None:
    assert float(loss([([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], True, False)])) == 0.0
