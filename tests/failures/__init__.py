"""Every kind of change, failing at every step in every way: what stands afterwards is as the outcome says."""
