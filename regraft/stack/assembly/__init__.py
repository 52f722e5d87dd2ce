"""Makes one document of the files of a stack: what they include, and which robots they use."""
