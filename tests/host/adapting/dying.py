"""A manager that a file tells at which point of a confirmation it is to be killed."""

from __future__ import annotations

from pathlib import Path

from regraft import Parameter
from tests.adaptation.watching.gauging import POINTS, DyingManager


class ToldManager(DyingManager):
    """Is killed at the point that the file ``told`` names as it is activated; the next run takes no notice of it."""

    told = Parameter("", unit="path", read_only=True)

    def on_activate(self) -> None:
        told = Path(self.told)
        if told.exists():
            self._prepare(*POINTS[told.read_text()])
            told.unlink()
        super().on_activate()
