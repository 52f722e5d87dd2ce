"""Names, of one robot or reserved."""
