"""Planning, following and single motions as components of their own, with the names and meanings of Nav2's servers.

The navigator does all of it for one goal. These leave it to others, such as a behaviour tree, what follows what.
"""
