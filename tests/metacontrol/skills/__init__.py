"""The language of robot skills."""
