"""The client of tools that talk to a running system from outside: the command line, the REST gateway, a script."""

from regraft.client.client import Client
from regraft.client.errors import ClientError, ControlRefused, NoAnswer, NoSuchComponent, NoSuchHost
from regraft.client.json_view import as_json, read_plain
from regraft.client.requests import ClientGoal
from regraft.client.seen import ComponentSeen, HostSeen
from regraft.client.topics import Subscription, TopicSample

__all__ = [
    "Client",
    "ClientError",
    "ClientGoal",
    "ComponentSeen",
    "ControlRefused",
    "HostSeen",
    "NoAnswer",
    "NoSuchComponent",
    "NoSuchHost",
    "Subscription",
    "TopicSample",
    "as_json",
    "read_plain",
]
