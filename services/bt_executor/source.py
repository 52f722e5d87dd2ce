"""Where a mission's tree comes from, and how it is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from services.bt_executor.engine import Blackboard, Registry, Tree, TreeError, load_file, load_text


class Unloadable(Exception):
    """A tree that cannot be built; the text names file, line and node."""


@dataclass(frozen=True, slots=True)
class Source:
    """A tree's XML: a file, or text whose relative includes start from ``folder``.

    Attributes:
        file: The file, empty where there is text.
        text: The XML text, empty where there is a file.
        main: The ID of the tree to execute, by default what the XML says.
        folder: Where relative includes of text start from.
    """

    file: str = ""
    text: str = ""
    main: str = ""
    folder: str = ""

    def load(self, registry: Registry, board: Blackboard) -> Tree:
        """Make the tree, with ``board`` as its top blackboard and source of time.

        Raises:
            Unloadable: it cannot be built.
        """
        try:
            if self.file:
                return load_file(self.file, registry, main=self.main, blackboard=board)
            return load_text(self.text, registry, main=self.main, blackboard=board, folder=Path(self.folder or "."))
        except TreeError as error:
            node = f" (node '{error.node}')" if error.node and error.node not in str(error) else ""
            raise Unloadable(f"{error}{node}") from error
        except OSError as error:
            raise Unloadable(f"cannot read {self.file or 'an included file'}: {error.strerror}") from error
