"""The codes of refusals, for programs."""

from __future__ import annotations

from enum import Enum


class RefusalCode(Enum):
    """Why a request was refused, for programs: the text next to it is for people, and may change."""

    REFUSED = "refused"
    """For a reason of the service's own."""
    MALFORMED = "malformed"
    """The request has not the right form, or a value out of its bounds."""
    INVALID = "invalid"
    """It has the right form, but what it holds cannot be used, such as a tree that cannot be built."""
    NOT_FOUND = "not_found"
    """It names something that does not exist."""
    CONFLICT = "conflict"
    """It is not possible in the current state of what it is about."""
    KEY_REUSED = "key_reused"
    """Its idempotency key belongs to another request."""
    THROTTLED = "throttled"
    """Its source asks too often."""
    QUEUE_FULL = "queue_full"
    """Too many requests wait already."""
    BUSY = "busy"
    """The action pursues as many goals as it does at once."""
    STARTING = "starting"
    """The service has not started yet."""
    NOT_ACTIVE = "not_active"
    """Its component serves only while active."""
    UNAVAILABLE = "unavailable"
    """Something that the service needs is missing now."""
