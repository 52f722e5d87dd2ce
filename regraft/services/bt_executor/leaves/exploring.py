"""The leaves for exploring: where to look next, and keeping the map."""

from __future__ import annotations

from typing import Any

from behavior_tree import SUCCESS, Input, Output, Status
from regraft.bus_schema.messages.maps import Frontier, MapFile, NextFrontier, SaveMap
from regraft.services.bt_executor.leaves.asking_leaf import Asking, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked


class AskNextFrontier(Asking):
    """Asks where the map ends next; succeeds when that is answered, also if nothing is left to explore."""

    unreached = Input(bool, default=False, description="whether the robot did not get to the one given before")
    service = Input(str, default="next_frontier", description="the service that knows")
    timeout = Input(float, default=15.0, description="seconds to wait for the answer")
    found = Output(bool, description="whether the map still ends somewhere")
    left = Output(int, description="how many frontiers are left")
    goal = Output[Any](description="where to look from, for NavigateTo; written only if there is a frontier")
    distance = Output(float, description="metres to the goal")
    length = Output(float, description="metres of the frontier")

    def ask(self) -> Asked[Any]:
        """Ask the explorer."""
        return self.context.call(self.service, NextFrontier(self.unreached), Frontier, timeout=self.timeout)

    def answered(self, answer: Frontier) -> Status:
        """Write where to look next."""
        write_if_connected(self, "found", answer.found)
        write_if_connected(self, "left", answer.left)
        if answer.goal is not None:
            write_if_connected(self, "goal", answer.goal)
            write_if_connected(self, "distance", answer.distance)
            write_if_connected(self, "length", answer.length)
        return SUCCESS


class KeepMap(Asking):
    """Has the map written to a file; succeeds when it is there."""

    required_ports = ("file",)

    file = Input(str, description="the file, in the mapper's folder")
    service = Input(str, default="save_map", description="the service that writes it")
    timeout = Input(float, default=10.0, description="seconds to wait for the answer")
    saved_as = Output(str, description="the file that was written")
    known_area = Output(float, description="square metres that the map knows")

    def ask(self) -> Asked[Any]:
        """Ask the mapper."""
        return self.context.call(self.service, SaveMap(self.file), MapFile, timeout=self.timeout)

    def answered(self, answer: MapFile) -> Status:
        """Write what was written."""
        write_if_connected(self, "saved_as", answer.file)
        write_if_connected(self, "known_area", answer.known_area)
        return SUCCESS
