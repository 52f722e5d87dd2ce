"""The rules that choices obey, and the combinations that they allow."""
