"""Shared parts of tests: how they wait, and how they start and end what they test. Each file has one subject.

- ``waiting``: conditions, within bounds; ``workers``: how many processes run the tests; ``ports``: free TCP ports
- ``paths``: where the project's files are; ``wheels``: the project as a package; ``renderers``: ways to draw
- ``processes``: looks at any process; ``commands``: the command line as processes of its own
- ``launcher``: forks commands from a process that has the command line imported
- ``systems``, ``hosts``, ``frog``: whole systems, further hosts, FROG, each started as a user starts it
- ``buses``, ``threads``: a bus of either kind, and components on threads of this process
- ``site``, ``step_site``: components on such threads, in real and in simulated time
- ``tables``: one test for a whole table
- ``nursery``: components as processes, without a host
"""
