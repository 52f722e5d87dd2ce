"""Commands about stack files, without running them."""
