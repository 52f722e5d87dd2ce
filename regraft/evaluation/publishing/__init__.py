"""Publishing results: the tables of pages, and making runs again."""
