"""``regraft host --offer``: what a joining host offers, spelt as in the ``hosts`` of a stack file."""

from __future__ import annotations

import math
from dataclasses import replace

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.description import check_amounts, check_devices
from regraft.bus_schema.model.hosts.capability import UNITS
from regraft.bus_schema.model.hosts.offers import HostOffer
from regraft.cli.outcomes import BadInput
from regraft.stack.sections.limits import memory_amount
from regraft.stack.yaml.nodes import NumberTooLarge, scalar

RIGHT = "must be a finite number of at least 0, such as power=20"


def read_offer(given: list[str]) -> HostOffer:
    """Return what is offered: NAME=AMOUNT is an amount, a name alone a device; raises BadInput."""
    found, seen = HostOffer(), set[str]()
    for each in given:
        name, equals, text = each.partition("=")
        if name in seen:
            raise BadInput(f"--offer {each}: {name!r} is offered twice: give it once")
        seen.add(name)
        found = _with_amount(found, each, name, text) if equals else _with_device(found, each)
    return found


def _with_amount(offer: HostOffer, given: str, name: str, text: str) -> HostOffer:
    if not name:
        raise BadInput(f"--offer {given}: names nothing before the '=': must be NAME=AMOUNT, such as power=20")
    value = _number(given, name, text)
    if not 0.0 <= value < math.inf:
        raise BadInput(f"--offer {given}: {name} is {value:g}, {RIGHT}")
    if name == "cpu":
        return replace(offer, cpu=value)
    if name == "memory":
        return replace(offer, memory=value)
    try:
        check_amounts({name: value})
    except BadMessage as error:
        raise BadInput(f"--offer {given}: {error.why}; a device is --offer NAME") from None
    return replace(offer, amounts={**offer.amounts, name: value})


def _number(given: str, name: str, text: str) -> float:
    try:
        value = scalar(text.strip())
    except NumberTooLarge:
        raise BadInput(f"--offer {given}: {name} is infinite, {RIGHT}") from None
    if name == "memory" and isinstance(value, str):
        amount = memory_amount(value)
        if amount is None:
            raise BadInput(f"--offer {given}: must be an amount such as memory='512 MB', or a number of MiB")
        return amount
    if isinstance(value, bool) or not isinstance(value, int | float):
        shown = repr(text.strip()) if text.strip() else "empty"
        raise BadInput(f"--offer {given}: {name} is {shown}, {RIGHT}; a device has no '='")
    return float(value)


def _with_device(offer: HostOffer, given: str) -> HostOffer:
    try:
        check_devices((given,))
    except BadMessage as error:
        raise BadInput(f"--offer {given}: {error.why}; an amount is NAME=AMOUNT, such as power=20") from None
    if given in (*UNITS, "devices"):
        raise BadInput(f"--offer {given}: is an amount: give it as {given}=AMOUNT")
    return replace(offer, devices=(*offer.devices, given))
