"""Files for system_modes, observers and ontologies."""
