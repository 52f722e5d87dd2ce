"""Objectives of metacontrollers: asking for them, and seeing what became of them."""
