"""The subjects of the routes: the adaptation manager, the components, the events of the system."""
