"""The configuration of a mocked node."""

from dataclasses import dataclass
from typing import Any, Final

from ..status import IDLE, STATUS_NAMES, SUCCESS, Status, status_from_name

_TEXTS: Final = ("return_status_script", "success_script", "failure_script", "post_script")
_KEYS: Final = ("return_status", "async_delay", *_TEXTS)


@dataclass(frozen=True, slots=True)
class MockConfig:
    """A mocked node's result and script; BehaviorTree.CPP calls this TestNodeConfig.

    Attributes:
        return_status: The result.
        return_status_script: A script that gives the result instead, as a status's name or number; it may use the
            names as they are, as in ``battery > 20 ? SUCCESS : FAILURE``. Run when the node completes.
        async_delay: How long the node runs before it completes, in milliseconds.
        success_script: Run when it succeeds.
        failure_script: Run when it fails.
        post_script: Run after the other two, and also if the result is RUNNING or SKIPPED. No script runs on a halt.
    """

    return_status: Status = SUCCESS
    return_status_script: str = ""
    async_delay: int = 0
    success_script: str = ""
    failure_script: str = ""
    post_script: str = ""

    def __post_init__(self) -> None:
        if self.return_status == IDLE and not self.return_status_script:
            raise ValueError(f"return_status is IDLE; a node returns one of {', '.join(STATUS_NAMES[1:])}")
        if self.async_delay < 0:
            raise ValueError(f"async_delay is {self.async_delay} ms; it must not be negative")


def config_from_plain(name: str, given: Any) -> MockConfig:
    """Make a config from what JSON gives.

    Raises:
        ValueError: It is no object, lacks a result, or has something unknown.
    """
    if not isinstance(given, dict):
        raise ValueError(f"TestNodeConfigs: '{name}' must be an object")
    unknown = [key for key in given if key not in _KEYS]
    if unknown:
        raise ValueError(f"TestNodeConfigs: '{name}' has '{unknown[0]}'; there are {', '.join(_KEYS)}")
    if "return_status" not in given and "return_status_script" not in given:
        raise ValueError(f"TestNodeConfigs: '{name}' needs return_status or return_status_script")
    for key in ("return_status", *_TEXTS):
        if not isinstance(given.get(key, ""), str):
            raise ValueError(f"TestNodeConfigs: '{name}': {key} must be text")
    delay = given.get("async_delay", 0)
    if not isinstance(delay, int) or isinstance(delay, bool):
        raise ValueError(f"TestNodeConfigs: '{name}': async_delay must be a whole number of milliseconds")
    status = status_from_name(given["return_status"]) if "return_status" in given else SUCCESS
    return MockConfig(status, async_delay=delay, **{key: given[key] for key in _TEXTS if key in given})
