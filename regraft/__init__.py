"""Regraft: robots that adapt while they work. An author of components imports all that one needs from here."""

import os
from typing import TYPE_CHECKING

# Before numpy is loaded: a robot has many small processes, and those that are forked must begin with one thread.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

if TYPE_CHECKING:
    from regraft.component.authoring import *  # noqa: F403
    from regraft.component.authoring import __all__ as __all__
else:
    # The command line lies in this package too: it takes an interrupt from its first line on, before all that is slow.
    def __getattr__(name: str) -> object:
        """Return one of the names that authors import; the first that is asked for has all of them imported."""
        if name == "__all__" or not name.startswith("_"):
            from regraft.component import authoring

            if name == "__all__" or name in authoring.__all__:
                return getattr(authoring, name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__() -> list[str]:
        """Return what the module has, with what authors import."""
        from regraft.component import authoring

        return sorted({*globals(), *authoring.__all__})
