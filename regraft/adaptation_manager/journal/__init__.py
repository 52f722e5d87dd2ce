"""The journal, the architecture that it holds, and what is published of both."""
