"""What a simulated robot senses and acts with, a file a kind."""
