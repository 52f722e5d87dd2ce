"""Components that observe a system for a metacontroller: failures and recoveries, measured qualities, the context."""
