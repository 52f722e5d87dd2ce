"""The leaf that looks for something."""

from __future__ import annotations

from typing import Any

from behavior_tree import SUCCESS, Input, Output, Status
from regraft.bus_schema.messages.perception import Detect, Sightings
from regraft.services.bt_executor.leaves.asking_leaf import Asking, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked


class DetectObject(Asking):
    """Looks for an object in the next pictures; succeeds when they were looked at, seen or not.

    It fails where the detector states that none of them was of use, being black or frozen: the result is unknown.
    """

    label = Input(str, default="hydrant", description="what to look for")
    pictures = Input(int, description="how many pictures; by default as many as the detector thinks fit")
    service = Input(str, default="detect", description="the service that looks")
    timeout = Input(float, default=10.0, description="seconds to wait for the answer")
    looked = Output(int, description="how many pictures were looked at")
    useful = Output(int, description="how many of them were of use; all, if not reported")
    paid = Output(int, description="how many of them took energy from the robot's battery; all, if not reported")
    picture_energy = Output(float, description="joules that each of these took; written only if reported")
    hits = Output(int, description="in how many of them it was seen")
    found = Output(bool, description="whether it was seen at all")
    confidence = Output(float, description="of the best sighting, 0 if it was not seen")
    x = Output(float, description="where it is by all sightings, in metres; written only if it was seen")
    y = Output(float, description="where it is by all sightings, in metres; written only if it was seen")
    spread = Output(
        float, description="metres between sightings and that place, 0 if it was seen once; written only if it was seen"
    )
    frame = Output(str, description="the frame of x and y; written only if it was seen")

    def ask(self) -> Asked[Any]:
        """Ask the detector."""
        pictures = self.pictures if "pictures" in self.setup.attributes else None
        return self.context.call(self.service, Detect(self.label, pictures), Sightings, timeout=self.timeout)

    def answered(self, answer: Sightings) -> Status:
        """Write what was seen."""
        best = answer.best
        useful = answer.pictures if answer.useful is None else answer.useful
        outputs: dict[str, int | float | str] = {
            "looked": answer.pictures,
            "useful": useful,
            "paid": answer.pictures if answer.paid is None else answer.paid,
            "hits": answer.hits,
            "found": answer.hits > 0,
            "confidence": best.confidence if best else 0.0,
        }
        if answer.picture_energy is not None:
            outputs["picture_energy"] = answer.picture_energy
        if best:
            place, frame = (answer.position, answer.frame) if answer.position else (best.position, best.frame)
            outputs |= {"x": place.x, "y": place.y, "frame": frame, "spread": answer.spread or 0.0}
        for port, value in outputs.items():
            write_if_connected(self, port, value)
        if answer.pictures and not useful:
            return self.failed(f"of {answer.pictures} pictures none was of use: the camera is black, blank or frozen")
        return SUCCESS
