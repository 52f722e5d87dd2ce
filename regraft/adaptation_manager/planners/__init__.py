"""Planners: whatever decides *when* and *what* to adapt. Each is one folder or module here.

A planner never touches a component. It observes the bus like any other component, and what it decides is an
``AdaptationRequest``, called at the manager's service ``adaptation_manager/adapt``; the ``AdaptationReport``
that comes back says what became of it. So a planner is an ordinary ``regraft.Component`` of a stack: it can
be swapped, it can run on another host, it can be written in another language, and REST and the command line
reach the manager by the same door. ``actor`` names the planner in the journal, ``reason`` says why,
``revision`` guards a decision that was made on an architecture that may have changed since, and ``dry_run``
asks whether an option is possible at all.

A planner that can be asked offers ``planners/NAME/propose`` and ``planners/NAME/describe``, with the messages of
``regraft.bus_schema.messages.planning``. ``manager_client`` is what planners have in common: seeing the architecture,
having changes carried out, taking turns.
"""
