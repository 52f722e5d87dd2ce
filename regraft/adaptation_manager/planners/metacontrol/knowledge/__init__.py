"""The knowledge base: three levels of OWL files, a typed view of them, queries, and the rules that they hold."""
