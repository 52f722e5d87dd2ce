"""Mistakes in the options of ``regraft mission``, each with what is reported then; `right` is a file with a tree."""

from __future__ import annotations

MISSION_OPTIONS: list[tuple[str, str]] = [
    ("mission get --board Patrl", "there is no sub-tree 'Patrl'"),
    ("mission set rounds=1 --board Patrl", "there is no sub-tree 'Patrl'"),
    ("mission load right --main Patrl", "Patrl"),
    ("mission check right --main Patrl", "Patrl"),
    ("mission check right --nodes regraft.services.nods:X", "services"),
    ("mission check right --trees nowhere", "no such file or folder"),
    ("mission load", "name a file, or by --main a tree"),
    ("mission swap --main Patrl", "there is no tree 'Patrl'"),
    ("mission break drve", "the tree has no node 'drve'"),
    ("mission break wait --result running", "'running' is not one of 'success', 'failure'"),
    ("mission clear drve", "the tree has no node 'drve'"),
    ("mission continue --result skipped", "'skipped' is not one of 'success', 'failure'"),
    ("mission next --result done", "'done' is not one of 'success', 'failure'"),
    ("mission show --reset", "--reset is of --counts"),
    ("mission status --reset", "--reset is of --counts"),
    ("mission models --nodes regraft.services.nods:X", "services"),
    ("mission models --stack STACk", "no such file"),
    ("mission dot right --main Patrl", "Patrl"),
    ("mission dot right --out tree.png", "must end in .dot or .svg"),
    ("mission convert right", "is of version 4 already"),
    ("mission dry-run right --main Patrl", "Patrl"),
    ("mission dry-run right --mocks nowhere", "nowhere: cannot be read"),
    ("mission dry-run right --mocks nonsense", "nonsense: substitution rules"),
    ("mission dry-run right --set rounds", "name=value"),
    ("mission dry-run right --for never", "must be a number of seconds"),
    ("mission replay right --at 1 --tick 2", "exclude each other"),
]
