"""The leaves that act on the bus, one kind per file; `registry` lists them.

A leaf of one's own subclasses `Asking`, or an engine class whose constructor takes ``context``, and gets
a `LeafContext`. A class, or a list of classes, becomes known by the executor's parameter ``nodes``, or by the
entry point group ``regraft.tree_nodes`` of a package.
"""
