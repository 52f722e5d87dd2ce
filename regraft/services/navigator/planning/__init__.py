"""From a map to a path, and to the path that is kept while the map grows."""
