"""The control loop of a metacontroller: objectives, monitoring, modes of the stack, cycles."""
