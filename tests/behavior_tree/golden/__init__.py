"""Other engines' traces and cases, and the engine by itself."""
