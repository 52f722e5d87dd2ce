"""The metacontroller's reasoning: which objectives are in error, and which designs to select for them."""
