"""Options and arguments that several commands about mission files share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

TreeFile = Annotated[Path, typer.Argument(metavar="FILE", help="BehaviorTree.CPP XML.")]
MainOption = Annotated[str, typer.Option("--main", metavar="ID", help="The tree to run, if the file has several.")]
NodesOption = Annotated[
    list[str] | None,
    typer.Option(
        "--nodes",
        metavar="MODEL.xml|MODULE:NAME",
        help="Further node types: a file with a TreeNodesModel, or where classes are; may be repeated.",
    ),
]
TreesOption = Annotated[
    list[Path] | None,
    typer.Option("--trees", metavar="PATH", help="A file or folder of further trees, a library; may be repeated."),
]
StackOption = Annotated[
    Path | None,
    typer.Option("--stack", metavar="STACK", help="A stack whose mission executors know further node types and trees."),
]
