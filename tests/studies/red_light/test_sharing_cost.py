"""The table of what sharing costs, from a hand-made recording."""

from dataclasses import replace

import numpy as np
import pytest

from fmus.messages.records import APM, BSM, frame
from studies.red_light.sharing_cost import COLUMNS, row, sharing_cost
from tests.studies.red_light.test_metrics import Samples, packet, recording


def test_bsms_do_not_count_and_only_the_sharing_node_sends_its_data() -> None:
    rows = np.concatenate([packet(number) for number in range(5)])
    rows["size"] = 1, 10, 100, 1000, 10_000
    rows["kind"][0], rows["kind"][3] = BSM, APM
    rows["source"][4] = 1  # the ego's
    busy = [np.array([0.2, 0.4]), np.array([]), np.array([0.5])]
    run = recording() | {
        "facilities.packets": Samples([frame("PKTS", rows), b"", b""]),
        "channel.busy_ratio": Samples(busy),
    }
    found = sharing_cost(run)
    assert found.bytes == 11_110
    assert found.data_bytes == 110
    assert found.busy_ratio == pytest.approx((0.3 + 0.5) / 2)
    assert found.collision
    assert found.known == pytest.approx(0.2)


def test_a_row_has_the_values_of_all_runs_and_a_dash_for_what_is_not_known() -> None:
    one = sharing_cost(recording() | {"channel.busy_ratio": Samples([np.array([0.25])] * 3)})
    other = replace(one, collision=False, gap=2.057, prr=None, known=None, bytes=1_499_600)
    found = row([one, other])
    assert " | ".join(found) == (
        "yes, no | 0.00, 2.06 | 0.67, - | 0.2, - | 1, 1500 | 1, 1 | 0.25, 0.25"
    )
    assert len(found) == len(COLUMNS)
