"""Planners decide *when* and *what* to adapt. Each is one folder or module here.

A planner never touches a component. It observes the bus like any other component. Its decision is an
``AdaptationRequest`` to the manager's service ``adaptation_manager/adapt``. The ``AdaptationReport`` that is returned
has the outcome. So a planner is an ordinary ``regraft.Component`` of a stack. It can be swapped, run on another host,
or be written in another language. REST and the command line use the same service. ``actor`` names the planner in the
journal, and ``reason`` gives the reason. ``revision`` guards a decision: the architecture may have changed since.
``dry_run`` asks whether an option is possible at all.

A planner that can be asked offers ``planners/NAME/propose`` and ``planners/NAME/describe``, with the messages of
``regraft.bus_schema.messages.planning``. ``manager_client`` is what planners have in common: seeing the architecture,
having changes carried out, taking turns.
"""
