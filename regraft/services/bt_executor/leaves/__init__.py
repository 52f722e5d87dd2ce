"""The leaves that act on the bus, one kind per file; `registry` lists them.

A leaf of one's own subclasses `Asking`, or an engine class whose constructor takes ``context``, and gets a
`LeafContext`. The executor's parameter ``nodes`` names a class, or a list of classes. So does a package's entry point
of the group ``regraft.tree_nodes``.
"""
