"""What the routes show and change: the adaptation manager, the components, the events of the system."""
