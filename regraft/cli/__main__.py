"""``python -m regraft.cli`` is ``regraft``."""

from regraft.cli.main import main

main()
