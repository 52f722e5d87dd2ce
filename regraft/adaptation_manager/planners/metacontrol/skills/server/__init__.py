"""A language server for editors (Language Server Protocol 3.17), for texts as they are in the editor."""
