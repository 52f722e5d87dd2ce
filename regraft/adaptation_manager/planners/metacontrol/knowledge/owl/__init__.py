"""Reads OWL files in RDF/XML: within limits, with places, as facts, axioms and rules; and writes them."""
