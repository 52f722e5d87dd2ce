"""Who may take part: secrets, certificates, the gate of the first host, access tokens."""
