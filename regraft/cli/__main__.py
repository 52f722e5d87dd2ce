"""``python -m regraft.cli`` is ``regraft``."""

from regraft.cli.entry import main

main()
