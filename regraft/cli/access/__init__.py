"""``regraft certificates`` and ``token``: who may take part, and who may act."""
