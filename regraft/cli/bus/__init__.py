"""``regraft topic``, ``service``, ``param``, ``types``: what components publish, offer and let one set."""
