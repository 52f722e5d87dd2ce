"""``regraft host --offer`` reads amounts and devices as stack files spell them, and says what is wrong with others."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from regraft.bus_schema.model.hosts.offers import HostOffer
from regraft.cli.outcomes import BadInput
from regraft.cli.system.host_offer import read_offer
from tests.cli.app import whole


def test_amounts_and_devices_are_offered() -> None:
    offer = read_offer(["power=20", "accelerator_area=0.5", "cpu=2", "memory=512 MiB", "fpga"])
    assert offer == HostOffer(2.0, 512.0, ("fpga",), {"power": 20.0, "accelerator_area": 0.5})


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (["power=much"], "power is 'much', must be a finite number of at least 0, such as power=20"),
        (["power="], "power is empty, must be a finite number of at least 0"),
        (["power=-1"], "power is -1, must be a finite number of at least 0"),
        (["power=.inf"], "power is inf, must be a finite number of at least 0"),
        (["power=1e400"], "power is infinite, must be a finite number of at least 0"),
        (["power=.nan"], "power is nan, must be a finite number of at least 0"),
        (["power=nan"], "power is 'nan', must be a finite number of at least 0"),
        (["power=yes"], "power is 'yes', must be a finite number of at least 0"),
        (["memory=2 pounds"], "must be an amount such as memory='512 MB', or a number of MiB"),
        (["devices=2"], "is a field of its own"),
        (["cpu"], "is an amount: give it as cpu=AMOUNT"),
        (["=3"], "names nothing before the '=': must be NAME=AMOUNT, such as power=20"),
        (["a b=3"], "'a b' cannot name an amount: must be 1 to 128 characters without blanks and '='"),
        (["a b"], "'a b' cannot name a device: must be 1 to 128 characters without blanks and '='"),
        ([""], "'' cannot name a device"),
        (["power=1", "power=2"], "'power' is offered twice"),
    ],
)
def test_a_wrong_offer_is_refused_with_what_would_be_right(given: list[str], why: str) -> None:
    with pytest.raises(BadInput) as refused:
        read_offer(given)
    assert str(refused.value).startswith(f"--offer {given[-1]}: ")
    assert why in str(refused.value)


def test_an_offer_belongs_to_a_host_that_joins() -> None:
    refused = CliRunner().invoke(whole(), ["host", "--offer", "power=1"])
    assert refused.exit_code == 2
